// SPDX-License-Identifier: MIT
#include "epics/ioc/service_stop.h"

#include <unistd.h>

#include <chrono>
#include <thread>

#include "base/print_error.h"

namespace mpf {
namespace {

constexpr std::chrono::seconds kPatience{5};

}  // namespace

ServiceStop::ServiceStop() {
  std::thread([this] { watch(); }).detach();
}

void ServiceStop::wait() {
  started_.set_value();
  stopped_.get_future().wait();
}

void ServiceStop::watch() noexcept {
  bell_.wait();
  if (started_.get_future().wait_for(kPatience) == std::future_status::timeout) {
    printError("mpf-ioc: stopped before its startup was complete\n");
    ::_exit(1);
  }
  stopped_.set_value();
}

}  // namespace mpf
