// SPDX-License-Identifier: MIT
#include "tools/tap/recording.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <kj/exception.h>
#include <stdexcept>

#include "base/system_call.h"
#include "schema/conversion.h"

namespace mpf::tools {

RecordingWriter::RecordingWriter(std::string path) : file_(std::move(path), 0600) {}

void RecordingWriter::write(capnp::MessageBuilder& record) {
  const auto words = capnp::messageToFlatArray(record);
  const auto bytes = words.asChars();
  file_.write({bytes.begin(), bytes.size()});
}

RecordingReader::RecordingReader(std::string path)
    : path_(std::move(path)),
      // O_NONBLOCK: the open of a FIFO would wait for a writer
      file_(checkCall(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK), "open", path_)),
      stream_(file_.get()),
      buffered_(stream_) {
  struct stat status{};
  checkCall(::fstat(file_.get(), &status), "look at", path_);
  if (!S_ISREG(status.st_mode))
    throw std::runtime_error(fmt::format(
        "{}: not a regular file; name a recording that `mpf tap --write` wrote", path_));
  bytes_ = static_cast<std::uint64_t>(status.st_size);
  limits_ = ConversionLimits{.maxValueBytes = bytes_}.readerOptions();
}

bool RecordingReader::tryNext(const std::function<void(wire::Record::Reader)>& take) try {
  const auto buffered = buffered_.tryGetReadBuffer().size();
  if (buffered == 0) return false;
  ++number_;
  begin_ =
      static_cast<std::uint64_t>(checkCall(::lseek(file_.get(), 0, SEEK_CUR), "lseek", path_)) -
      buffered;
  capnp::InputStreamMessageReader message(buffered_, limits_);
  take(message.getRoot<wire::Record>());
  return true;
} catch (const kj::Exception&) {  // its text describes Cap'n Proto's internals, not the file
  if (number_ == 1) {
    throw std::runtime_error(
        fmt::format("{}: not a recording of `mpf tap --write`, or one that was cut off within its "
                    "first record",
                    place()));
  }
  throw std::runtime_error(
      fmt::format("{}: the file is damaged, or was cut off here; the {} before it can be read: "
                  "`head -c {} FILE >NEW` keeps them, "
                  "`mpf tap --write` records again",
                  place(), number_ == 2 ? "record" : "records", begin_));
}

std::string RecordingReader::place() const {
  return fmt::format("{}: record {}, at byte {} of {}", path_, number_, begin_, bytes_);
}

}  // namespace mpf::tools
