// SPDX-License-Identifier: MIT
#include <mpf/server/programs/serial_server/stop_thread.h>

#include <utility>

namespace mpf {

StopThread::StopThread(std::function<void()> stop)
    : signals_([](void* bell) noexcept { static_cast<Bell*>(bell)->ring(); }, &bell_), thread_([this, stop = std::move(stop)] {
        bell_.wait();
        if (!ends_.load(std::memory_order_relaxed)) stop();
      }) {}

StopThread::~StopThread() {
  ends_.store(true, std::memory_order_relaxed);
  bell_.ring();
  thread_.join();
}

}  // namespace mpf
