// SPDX-License-Identifier: MIT
// StopThread: at SIGINT or SIGTERM calls a function, once, on a thread of its own, where it may do what a signal handler may not.
#pragma once

#include <atomic>
#include <functional>
#include <semaphore.h>
#include <thread>

#include <mpf/base/stop_signals.h>

namespace mpf {

class StopThread {
 public:
  explicit StopThread(std::function<void()> stop);
  // Afterwards the function does not run any more, and signals do what they did before.
  ~StopThread();
  StopThread(const StopThread&) = delete;
  StopThread& operator=(const StopThread&) = delete;

 private:
  class Bell {
   public:
    Bell() { ::sem_init(&semaphore_, 0, 0); }
    ~Bell() { ::sem_destroy(&semaphore_); }
    Bell(const Bell&) = delete;
    Bell& operator=(const Bell&) = delete;
    void ring() noexcept { ::sem_post(&semaphore_); }  // async-signal-safe
    void wait() noexcept {
      while (::sem_wait(&semaphore_) != 0) {  // EINTR
      }
    }

   private:
    sem_t semaphore_{};
  };

  Bell bell_;
  std::atomic<bool> ends_{false};
  StopSignals signals_;
  std::thread thread_;
};

}  // namespace mpf
