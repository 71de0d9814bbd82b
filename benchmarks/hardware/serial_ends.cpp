// SPDX-License-Identifier: MIT
#include "benchmarks/hardware/serial_ends.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/serial_commands.h>

#include "base/system_call.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

constexpr auto kTerminalsLimit = std::chrono::seconds(10);
constexpr int kAnswerMs = 10'000;
constexpr int kSettleMs = 100;

// The paths of terminals in the server's output: what follows kWords in a line.
std::vector<std::string> terminalsIn(const std::string& said) {
  constexpr std::string_view kWords = "its instrument may open ";
  std::vector<std::string> terminals;
  for (auto at = said.find(kWords); at != std::string::npos; at = said.find(kWords, at)) {
    at += kWords.size();
    const auto end = said.find('\n', at);
    if (end == std::string::npos) break;  // the line is not complete yet
    terminals.push_back(said.substr(at, end - at));
  }
  return terminals;
}

void writeAllTo(const FileDescriptor& terminal, const char* from, ssize_t count) {
  while (count > 0) {
    const auto written =
        checkCall(retryInterrupted([&] {
                    return ::write(terminal.get(), from, static_cast<std::size_t>(count));
                  }),
                  "write", "a model's terminal");
    from += written;
    count -= written;
  }
}

}  // namespace

Instruments::Instruments(const HardwareServers& servers) {
  std::vector<std::string> paths;
  const auto areKnown = [&] {
    return (paths = terminalsIn(servers.said())).size() == static_cast<std::size_t>(kPorts);
  };
  if (!waitUntil(areKnown, kTerminalsLimit))
    throw std::runtime_error("the serial server did not print the terminals of its ports in time");
  for (const auto& path : paths) {
    terminals_.emplace_back(
        checkCall(::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open", path));
    ::tcflush(terminals_.back().get(), TCIFLUSH);  // discards input that the previous row left
  }
}

void Instruments::play(bool echoes) {
  std::vector<pollfd> entries;
  entries.reserve(terminals_.size());
  for (const auto& terminal : terminals_)
    entries.push_back({.fd = terminal.get(), .events = POLLIN, .revents = 0});
  std::array<char, 1024> bytes{};
  for (;;) {
    checkCall(retryInterrupted([&] { return ::poll(entries.data(), entries.size(), -1); }), "poll");
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (entries[i].revents == 0) continue;
      const auto got = checkCall(
          retryInterrupted([&] { return ::read(entries[i].fd, bytes.data(), bytes.size()); }),
          "read", "a terminal");
      if (echoes) writeAllTo(terminals_[i], bytes.data(), got);
    }
  }
}

std::function<void(const RunContext&)> playInstruments(const Stage& stage,
                                                       const HardwareServers& servers,
                                                       bool echoes) {
  return [&stage, &servers, echoes](const RunContext& context) {
    pinTo(stage.placement().requester);
    Instruments instruments(servers);
    context.ready();
    instruments.play(echoes);
  };
}

PortClients::PortClients(const Bench& bench, int ports, std::size_t characters, bool awaitsEcho,
                         OnReply onReply)
    : characters_(characters),
      awaitsEcho_(awaitsEcho),
      onReply_(std::move(onReply)),
      dispatcher_(Backplane::attach(bench.backplane), {waitMode(bench.wait), {}}) {
  for (std::size_t port = 0; port < static_cast<std::size_t>(ports); ++port) {
    clients_.emplace_back(dispatcher_, [this, port](Message&& message) { take(port, message); });
    clients_.back().bind(fmt::format("port{}", port), 0);
  }
  for (auto& client : clients_) {
    if (!client.connectWait(kConnectLimit))
      throw std::runtime_error("not connected: " + client.notConnectedBecause());
  }
}

void PortClients::send(std::size_t port) {
  ask(port, awaitsEcho_ ? serial::cmdWriteRead | serial::cmdFlush : serial::cmdWrite, characters_,
      kAnswerMs);
}

void PortClients::ask(std::size_t port, std::int32_t command, std::size_t characters,
                      int timeoutMs) {
  auto request = clients_[port].alloc<Char8Array>(characters);
  std::ranges::fill(request.value(), 'x');
  if (characters != 0) request.value().back() = '\r';
  request->cmd = command | serial::cmdTimeoutMilliseconds;
  request->timeout = timeoutMs;
  if (clients_[port].send(std::move(request)) != SendResult::sent)
    throw std::runtime_error("a request could not be sent");
}

void PortClients::take(std::size_t port, const Message& message) {
  if (message.getType() == MessageType::connect) return;
  const auto* const reply = message.tryAs<Char8Array>();
  if (reply == nullptr)
    throw std::runtime_error(fmt::format("port {}: the reply is not a Char8Array message", port));
  if (std::exchange(settles_.at(port), false)) return onReply_(port, false);
  const auto read = message.valueAs<Char8Array>().size();
  if (reply->status == serial::serialServerStatusOK && (!awaitsEcho_ || read == characters_))
    return onReply_(port, true);
  if (!awaitsEcho_)
    throw std::runtime_error(fmt::format("port {}: reply with status {}", port, reply->status));
  countFaults(*reply);
  // Reads the rest of this echo, so that it is not taken for the beginning of the next one.
  settles_.at(port) = true;
  ask(port, serial::cmdRead, 0, kSettleMs);
}

void PortClients::countFaults(const Char8Array& reply) noexcept {
  ++faults_.shortAnswers;
  if (reply.status != serial::serialServerStatusOverflow &&
      reply.status != serial::serialServerStatusError)
    return;
  if ((reply.extra & serial::serialFaultOverrun) != 0) ++faults_.overruns;
  if ((reply.extra & serial::serialFaultParity) != 0) ++faults_.parity;
  if ((reply.extra & serial::serialFaultFraming) != 0) ++faults_.framing;
  if ((reply.extra & serial::serialFaultBreak) != 0) ++faults_.breaks;
}

LineFaultFigures PortClients::takeFaults() noexcept {
  return std::exchange(faults_, {.shortAnswers = 0});
}

}  // namespace mpf::bench
