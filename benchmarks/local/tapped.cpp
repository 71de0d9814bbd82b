// SPDX-License-Identifier: MIT
// The cost for two processes when `mpf tap` reads their messages. The kernel chooses the CPU of the
// tap: on a host with two CPUs, it shares one with a measured process.
#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <mpf/file_descriptor.h>

#include "base/program_beside.h"
#include "base/system_call.h"
#include "benchmarks/local/background.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

std::string tool() { return programBeside("mpf"); }

// Runs `mpf tap` from the folder of this program. The constructor returns when it follows the
// server. The tap writes the messages to /dev/null.
class Tap {
 public:
  explicit Tap(const std::string& backplane) {
    int ends[2];
    checkCall(::pipe2(ends, O_CLOEXEC), "pipe2");
    const FileDescriptor said(ends[0]);
    FileDescriptor says(ends[1]);
    pid_ = startProgram({tool(), "tap", kServer, "--backplane", backplane, "--write", "/dev/null"},
                        [&] {
                          cpu_set_t all;
                          std::memset(&all, 0xff, sizeof all);
                          ::sched_setaffinity(0, sizeof all, &all);
                          ::dup2(says.get(), STDERR_FILENO);
                        });
    says.reset();
    char first{};
    if (retryInterrupted([&] { return ::read(said.get(), &first, 1); }) != 1)
      throw std::runtime_error(tool() + " tap could not be started");
  }
  ~Tap() { killProcess(pid_); }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

 private:
  int pid_ = 0;
};

}  // namespace

std::vector<Measurement> tappedMeasurements(const std::string& runName) {
  std::vector<Measurement> rows;
  for (const auto mode : {Mode::spin, Mode::block}) {
    for (const bool tapped : {false, true}) {
      Measurement row;
      row.question = "Round trip of 4 B beside a tap";
      row.name = std::string(kMpf) + (tapped ? ", tapped" : ", alone");
      row.mode = mode;
      row.bytes = 4;
      row.floorName = mode == Mode::block ? kFutexBounce : kBounce;
      row.floorBytes = 4;
      if (tapped && !std::filesystem::exists(tool())) row.skipped = tool() + " does not exist";
      const auto backplane = runName + "-tap" + (tapped ? "1" : "0") + toString(mode)[0];
      row.run = [=](const Stage& stage) {
        return roundTripBeside(
            stage, backplane, mode,
            tapped ? Background([=] { return std::make_shared<Tap>(backplane); }) : nullptr);
      };
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace mpf::bench
