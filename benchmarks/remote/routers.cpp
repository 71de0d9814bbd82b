// SPDX-License-Identifier: MIT
#include "benchmarks/remote/routers.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "base/program_beside.h"
#include "base/system_call.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

std::string readToEnd(const FileDescriptor& from) {
  std::string text;
  std::array<char, 1024> bytes{};
  for (ssize_t got = 0; (got = retryInterrupted(
                             [&] { return ::read(from.get(), bytes.data(), bytes.size()); })) > 0;)
    text.append(bytes.data(), static_cast<std::size_t>(got));
  return text;
}

}  // namespace

RouterPair::RouterPair(std::string program, std::string name, Placement placement,
                       Surroundings between)
    : program_(std::move(program)),
      name_(std::move(name)),
      placement_(std::move(placement)),
      between_(std::move(between)) {}

void RouterPair::start() try {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor ready(ends[0]);
  FileDescriptor tells(ends[1]);
  const auto location = std::to_string(kRemoteLocation);
  const auto enterServer = [&] {
    between_.enterServer();
    checkCall(::fcntl(tells.get(), F_SETFD, 0), "fcntl");  // the router inherits it
  };
  server_.program.start(
      {program_, "--backplane", serverBackplane(), "--serve", location, "--listen",
       between_.serverAddress() + ":0", "--plain", "--ready-fd", std::to_string(tells.get())},
      placement_.server, enterServer);
  tells.reset();
  auto address = readToEnd(ready);
  if (address.find('\n') == std::string::npos)
    throw std::runtime_error("the server's router did not start: " + server_.program.lastLine());
  address.resize(address.find('\n'));
  client_.program.start(
      {program_, "--backplane", clientBackplane(), "--remote", location + "=" + address, "--plain"},
      placement_.requester, [&] { between_.enterRequester(); });
} catch (...) {
  stop();
  throw;
}

void RouterPair::stop() noexcept {
  for (auto* router : {&client_, &server_}) router->program.stop();
  removeBackplanes(name_ + "-");
}

Outcome RouterPair::run(const std::function<Outcome()>& row) {
  Outcome outcome;
  outcome.error = complaint();
  if (!outcome.error.empty()) return outcome;
  outcome = row();
  if (outcome.error.empty()) return outcome;
  if (const auto ended = complaint(); !ended.empty()) {
    outcome.error += "; " + ended;
  } else if (const auto said = client_.program.lastLine(); !said.empty()) {
    outcome.error += "; last output of the client's router: " + said;
  }
  return outcome;
}

// Which router has ended; empty when both are running.
std::string RouterPair::complaint() {
  for (auto* router : {&server_, &client_}) {
    if (router->program.hasEnded())
      return std::string(router->side) + " has ended: " + router->program.lastLine();
  }
  return {};
}

std::string routerProgram() { return programBeside("mpf-router"); }

}  // namespace mpf::bench
