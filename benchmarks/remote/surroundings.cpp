// SPDX-License-Identifier: MIT
#include "benchmarks/remote/surroundings.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "base/system_call.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {
namespace {

constexpr const char* kOwnNet = "/proc/self/ns/net";
constexpr const char* kInterface = "mpf0";

FileDescriptor openNet() {
  return FileDescriptor(checkCall(::open(kOwnNet, O_RDONLY | O_CLOEXEC), "open", kOwnNet));
}

// Creates a network namespace. This process stays in its own.
std::shared_ptr<FileDescriptor> newNet() {
  const auto mine = openNet();
  checkCall(::unshare(CLONE_NEWNET), "unshare", "a network namespace");
  auto made = std::make_shared<FileDescriptor>(openNet());
  checkCall(::setns(mine.get(), CLONE_NEWNET), "setns",
            "the previous network namespace of this process");
  return made;
}

// Runs `ip` with these arguments in a namespace. Throws with its output if it fails.
void ip(const FileDescriptor& net, std::vector<std::string> words) {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor said(ends[0]);
  FileDescriptor says(ends[1]);
  words.insert(words.begin(), "ip");
  const int pid = startProgram(words, [&] {
    ::dup2(says.get(), STDERR_FILENO);
    checkCall(::setns(net.get(), CLONE_NEWNET), "setns", "a network namespace");
  });
  says.reset();
  std::string text;
  std::array<char, 256> bytes{};
  for (ssize_t got = 0; (got = retryInterrupted(
                             [&] { return ::read(said.get(), bytes.data(), bytes.size()); })) > 0;)
    text.append(bytes.data(), static_cast<std::size_t>(got));
  int status = 0;
  retryInterrupted([&] { return ::waitpid(pid, &status, 0); });
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNoSuchProgram)
    throw std::runtime_error("ip(8) is not installed (package iproute2)");
  throw std::runtime_error("ip: " + text.substr(0, text.find('\n')));
}

void giveAddress(const FileDescriptor& net, const std::string& address) {
  ip(net, {"address", "add", address, "dev", kInterface});
  ip(net, {"link", "set", kInterface, "up"});
  ip(net, {"link", "set", "lo", "up"});
}

}  // namespace

Surroundings Surroundings::loopback() {
  Surroundings made;
  made.serverAddress_ = "127.0.0.1";
  return made;
}

Surroundings Surroundings::namespaces() {
  Surroundings made;
  made.serverAddress_ = "10.0.0.1";
  made.server_ = newNet();
  made.requester_ = newNet();
  const auto other =
      "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(made.requester_->get());
  ip(*made.server_,
     {"link", "add", kInterface, "type", "veth", "peer", "name", kInterface, "netns", other});
  giveAddress(*made.server_, "10.0.0.1/30");
  giveAddress(*made.requester_, "10.0.0.2/30");
  return made;
}

void Surroundings::enter(const std::shared_ptr<FileDescriptor>& net) {
  if (net) checkCall(::setns(net->get(), CLONE_NEWNET), "setns", "a network namespace");
}

}  // namespace mpf::bench
