// SPDX-License-Identifier: MIT
#include <mpf/tools/recording.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <kj/exception.h>
#include <stdexcept>

#include <mpf/base/system_call.h>
#include <mpf/schema/conversion.h>

namespace mpf::tools {

RecordingWriter::RecordingWriter(std::string path) : file_(std::move(path), 0600) {}

void RecordingWriter::write(capnp::MessageBuilder& record) {
  const auto words = capnp::messageToFlatArray(record);
  const auto bytes = words.asChars();
  file_.write({bytes.begin(), bytes.size()});
}

RecordingReader::RecordingReader(std::string path)
    : path_(std::move(path)),
      file_(checkCall(::open(path_.c_str(), O_RDONLY | O_CLOEXEC), "open", path_)),
      stream_(file_.get()),
      buffered_(stream_) {
  struct stat status{};
  checkCall(::fstat(file_.get(), &status), "look at", path_);
  limits_ = ConversionLimits{.maxValueBytes = static_cast<std::size_t>(status.st_size)}.readerOptions();
}

bool RecordingReader::tryNext(const std::function<void(wire::Record::Reader)>& take) try {
  if (buffered_.tryGetReadBuffer().size() == 0) return false;
  ++number_;
  capnp::InputStreamMessageReader message(buffered_, limits_);
  take(message.getRoot<wire::Record>());
  return true;
} catch (const kj::Exception&) {
  const auto what = number_ == 1 ? "this is no recording of `mpf tap`, or one that was cut off within its first record"
                                 : "the file is damaged, or was cut off here";
  throw std::runtime_error(fmt::format("{}: record {}: {}", path_, number_, what));
}

}  // namespace mpf::tools
