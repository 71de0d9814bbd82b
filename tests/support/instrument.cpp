// SPDX-License-Identifier: MIT
#include "tests/support/instrument.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "tests/support/watchdog.h"

namespace mpf::test {

Instrument::Instrument() : Instrument(std::string()) {}

Instrument::Instrument(std::string linkPath)
    : bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")),
      linkPath_(std::move(linkPath)) {
  if (!linkPath_.empty()) plugIn();
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Instrument::~Instrument() = default;

void Instrument::behave(Behaviour behaviour) {
  const std::lock_guard lock(mutex_);
  behaviour_ = std::move(behaviour);
}

void Instrument::say(std::string_view text) {
  const std::lock_guard lock(mutex_);
  send(text);
}

void Instrument::connect(FileDescriptor line) {
  const std::lock_guard lock(mutex_);
  hangUp();
  line_ = std::move(line);
}

void Instrument::unplug() {
  const std::lock_guard lock(mutex_);
  hangUp();
}

void Instrument::plugIn() {
  const std::lock_guard lock(mutex_);
  hangUp();
  pty_ = std::make_unique<Pty>(linkPath_);
}

void Instrument::setReading(bool isReading) {
  const std::lock_guard lock(mutex_);
  isReading_ = isReading;
  wake();
}

bool Instrument::waitForReceived(std::string_view text) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, Watchdog::kPatience,
                           [&] { return received_.find(text) != std::string::npos; });
}

std::string Instrument::received() const {
  const std::lock_guard lock(mutex_);
  return received_;
}

termios Instrument::settings() const {
  const std::lock_guard lock(mutex_);
  return pty_->settings();
}

void Instrument::hangUp() {
  pty_.reset();
  line_.reset();
  command_.clear();
  outputs_.clear();
  wake();  // the line stays open until the thread's poll() returns
}

void Instrument::wake() const noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(::write(bell_.get(), &one, sizeof one));
}

int Instrument::descriptor() const { return pty_ ? pty_->master().get() : line_.get(); }

void Instrument::run(const std::stop_token& stop) {
  const std::stop_callback onStop(stop, [this] { wake(); });
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> entries{};
    int timeoutMs = -1;
    {
      const std::lock_guard lock(mutex_);
      entries = {pollfd{bell_.get(), POLLIN, 0}, pollfd{isReading_ ? descriptor() : -1, POLLIN, 0}};
      timeoutMs = msToNextOutput();
    }
    ::poll(entries.data(), entries.size(), timeoutMs);
    std::uint64_t rings = 0;
    static_cast<void>(::read(bell_.get(), &rings, sizeof rings));
    const std::lock_guard lock(mutex_);
    if (entries[1].revents != 0 && entries[1].fd == descriptor()) receive();
    sendDue();
  }
}

int Instrument::msToNextOutput() const {
  if (outputs_.empty()) return -1;
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(outputs_.front().at - Clock::now());
  return static_cast<int>(std::max<std::int64_t>(left.count(), 0));
}

void Instrument::receive() {
  pollfd ready{descriptor(), POLLIN, 0};
  if (::poll(&ready, 1, 0) <= 0) return;  // another line has this descriptor number now
  std::array<char, 4096> bytes{};
  const auto length = ::read(descriptor(), bytes.data(), bytes.size());
  if (length <= 0) return hangUp();
  const std::string_view arrived(bytes.data(), static_cast<std::size_t>(length));
  received_ += arrived;
  changed_.notify_all();
  for (const char byte : arrived) {
    if (byte == '\n') {
      execute(command_);
      command_.clear();
    } else if (byte != '\r') {
      command_ += byte;
    }
  }
}

void Instrument::execute(std::string_view command) {
  constexpr std::string_view kEcho = "ECHO ";
  if (command == "*IDN?") return answer("MPF,INSTRUMENT,0,1.0");
  if (command == "MEAS:VOLT?") return answer("1.234");
  if (command.substr(0, kEcho.size()) == kEcho)
    return answer(std::string(command.substr(kEcho.size())));
}

void Instrument::answer(const std::string& text) {
  if (behaviour_.isSilent) return;
  auto at = Clock::now() + behaviour_.delay;
  if (!outputs_.empty()) at = std::max(at, outputs_.back().at);
  if (!behaviour_.noise.empty()) outputs_.push_back({at, behaviour_.noise});
  const auto whole = text + behaviour_.answerEnd;
  if (!behaviour_.gap) return outputs_.push_back({at, whole});
  for (const char byte : whole) {
    outputs_.push_back({at, std::string(1, byte)});
    at += *behaviour_.gap;
  }
}

void Instrument::sendDue() {
  const auto now = Clock::now();
  const auto later = std::find_if(outputs_.begin(), outputs_.end(),
                                  [&](const Output& output) { return output.at > now; });
  const std::vector<Output> due(outputs_.begin(), later);
  outputs_.erase(outputs_.begin(), later);
  for (const auto& output : due) send(output.text);
}

void Instrument::send(std::string_view text) {
  while (!text.empty()) {
    const auto length =
        retryInterrupted([&] { return ::write(descriptor(), text.data(), text.size()); });
    if (length <= 0) return;  // hung up: the bytes are lost, as on any line
    text.remove_prefix(static_cast<std::size_t>(length));
  }
}

}  // namespace mpf::test
