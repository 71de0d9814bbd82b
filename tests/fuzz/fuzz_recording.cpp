// SPDX-License-Identifier: MIT
// Reads a recording as `mpf replay` does. The input is the content of the file.
#include <sys/mman.h>
#include <unistd.h>

#include <fmt/format.h>
#include <stdexcept>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "schema/conversion.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/talk.h"
#include "tools/tap/recording.h"

namespace mpf::test {
namespace {

// As Replayer::take() does.
void take(wire::Record::Reader record) {
  if (record.isOpened()) static_cast<void>(std::string(record.getOpened().getServer().cStr()));
  if (!record.isMessage()) return;
  ConversionError error;
  const auto message =
      tryFromWire(record.getMessage().getEnvelope(), {.maxValueBytes = SIZE_MAX}, error);
  if (message) lookAt(*message);
}

}  // namespace

void playRecording(std::span<const std::uint8_t> input) try {
  static const FileDescriptor file(
      checkCall(::memfd_create("recording", MFD_CLOEXEC), "create a file"));
  checkCall(::ftruncate(file.get(), static_cast<off_t>(input.size())), "cut a file");
  checkCall(::pwrite(file.get(), input.data(), input.size(), 0), "write to a file");
  tools::RecordingReader reader(fmt::format("/proc/self/fd/{}", file.get()));
  while (reader.tryNext(take)) {
  }
} catch (const std::runtime_error&) {  // NOLINT(bugprone-empty-catch): mpf replay reports it
}

}  // namespace mpf::test
