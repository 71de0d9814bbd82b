// SPDX-License-Identifier: MIT
// Readable: calls back on the event loop when a descriptor becomes readable. Bell: calls back on
// the event loop when any thread rings it.
//
// Threads  that of the event loop; Bell::ring() any.
#pragma once

#include <sys/eventfd.h>

#include <cerrno>
#include <functional>
#include <kj/async-unix.h>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "router/fatal_tasks.h"

namespace mpf::router {

class Readable {
 public:
  // `fd` outlives this object. The callback is also called once at the start. Each time, it must
  // read until nothing is left.
  Readable(kj::UnixEventPort& port, int fd, std::function<void()> callback)
      : observer_(port, fd, kj::UnixEventPort::FdObserver::OBSERVE_READ),
        callback_(std::move(callback)) {
    loop_.add(kj::evalLater([this] { return loop(); }));
  }

 private:
  kj::Promise<void> loop() {
    // Before the callback reads: data that arrives during the callback is not missed.
    auto next = observer_.whenBecomesReadable();
    callback_();
    return next.then([this] { return loop(); });
  }

  kj::UnixEventPort::FdObserver observer_;
  std::function<void()> callback_;
  FatalTasks loop_;
};

class Bell {
 public:
  Bell(kj::UnixEventPort& port, std::function<void()> callback)
      : fd_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")),
        readable_(port, fd_.get(), [this, callback = std::move(callback)] {
          eventfd_t rings = 0;
          static_cast<void>(::eventfd_read(fd_.get(), &rings));
          callback();
        }) {}
  void ring() const noexcept { static_cast<void>(::eventfd_write(fd_.get(), 1)); }

 private:
  FileDescriptor fd_;
  Readable readable_;
};

}  // namespace mpf::router
