// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_model.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <array>
#include <utility>

#include "base/signals_blocked.h"
#include "base/system_call.h"

namespace mpf {

PrologixModel::PrologixModel()
    : bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")),
      firmware_({.send = [this](std::string_view text) { send(text); },
                 .pause = [this](std::chrono::milliseconds duration) { return pause(duration); }}) {
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

PrologixModel::~PrologixModel() = default;

void PrologixModel::attach(const GpibAddress& address,
                           std::shared_ptr<GpibInstrumentModel> instrument) {
  firmware_.attach(address, std::move(instrument));
}

void PrologixModel::behave(Behaviour behaviour) {
  const std::lock_guard lock(mutex_);
  behaviour_ = std::move(behaviour);
}

PrologixModel::Behaviour PrologixModel::behaviour() const {
  const std::lock_guard lock(mutex_);
  return behaviour_;
}

void PrologixModel::connect(FileDescriptor line) {
  const std::lock_guard lock(mutex_);
  newLine_ = std::move(line);
  hasNewLine_ = true;
  wake();
}

void PrologixModel::wake() const noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(::write(bell_.get(), &one, sizeof one));
}

bool PrologixModel::isCut() const {
  const std::lock_guard lock(mutex_);
  return hasNewLine_ || !line_ || stop_.stop_requested();
}

// ---- the model's thread

void PrologixModel::run(const std::stop_token& stop) {
  stop_ = stop;
  const std::stop_callback onStop(stop, [this] { wake(); });
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> entries{pollfd{bell_.get(), POLLIN, 0}, pollfd{line_.get(), POLLIN, 0}};
    ::poll(entries.data(), entries.size(), -1);
    takeNewLine();
    if (entries[1].revents != 0 && entries[1].fd == line_.get()) receive();
  }
}

void PrologixModel::takeNewLine() {
  std::uint64_t rings = 0;
  static_cast<void>(::read(bell_.get(), &rings, sizeof rings));
  const std::lock_guard lock(mutex_);
  if (!std::exchange(hasNewLine_, false)) return;
  line_ = std::move(newLine_);
  lines_ = {};
  if (!line_) return;
  ::fcntl(line_.get(), F_SETFL, ::fcntl(line_.get(), F_GETFL) | O_NONBLOCK);
  const int yes = 1;  // fails where the line is no TCP connection
  ::setsockopt(line_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
}

void PrologixModel::receive() {
  std::array<char, 4096> bytes{};
  const auto length =
      retryInterrupted([&] { return ::read(line_.get(), bytes.data(), bytes.size()); });
  if (length < 0 && errno == EAGAIN) return;
  if (length <= 0) return line_.reset();
  for (const char byte : std::string_view(bytes.data(), static_cast<std::size_t>(length))) {
    const auto line = lines_.add(byte);
    if (line) execute(*line);
    if (isCut()) return;
  }
}

void PrologixModel::execute(const PrologixFirmwareModel::Lines::Line& line) {
  const auto now = behaviour();
  if (now.isSilent) return;
  if (now.cutsConnection) return line_.reset();
  if (now.delay.count() > 0 && !pause(now.delay)) return;
  send(now.garbage);
  firmware_.version = now.version;
  firmware_.hasRemoteEnable = now.hasRemoteEnable;
  firmware_.execute(line);
}

void PrologixModel::send(std::string_view text) {
  while (!text.empty() && !isCut()) {
    const auto length =
        retryInterrupted([&] { return ::write(line_.get(), text.data(), text.size()); });
    if (length > 0) text.remove_prefix(static_cast<std::size_t>(length));
    if (length >= 0) continue;
    if (errno != EAGAIN) return line_.reset();
    std::array<pollfd, 2> entries{pollfd{bell_.get(), POLLIN, 0}, pollfd{line_.get(), POLLOUT, 0}};
    ::poll(entries.data(), entries.size(), -1);
  }
}

bool PrologixModel::pause(std::chrono::milliseconds duration) {
  pollfd bell{bell_.get(), POLLIN, 0};
  ::poll(&bell, 1, static_cast<int>(duration.count()));
  return !isCut();
}

}  // namespace mpf
