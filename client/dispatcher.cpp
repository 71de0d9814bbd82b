// SPDX-License-Identifier: MIT
#include <mpf/dispatcher.h>

#include <map>
#include <mutex>
#include <string>

#include "client/dispatcher_impl.h"
#include "shm/per_process.h"

namespace mpf {
namespace {

struct SharedDispatchers {
  std::mutex mutex;  // guards the members below
  std::map<std::string, std::weak_ptr<Dispatcher>> ofBackplanes;
};

// Never destroyed: threads may use it while the process exits.
union NeverDestroyed {
  constexpr NeverDestroyed() noexcept : value() {}
  ~NeverDestroyed() {}
  PerProcess<SharedDispatchers> value;
};
constinit NeverDestroyed sharedDispatchers;

}  // namespace

Dispatcher::Dispatcher(const Backplane& backplane, const DispatcherOptions& options)
    : impl_(std::make_shared<Impl>(backplane, options)) {}
Dispatcher::~Dispatcher() { impl_->endThread(); }

std::shared_ptr<Dispatcher> Dispatcher::shared(const Backplane& backplane) {
  auto& shared = sharedDispatchers.value.get();
  const std::lock_guard lock(shared.mutex);
  auto& known = shared.ofBackplanes[backplane.name()];
  auto dispatcher = known.lock();
  if (!dispatcher) {
    dispatcher = std::make_shared<Dispatcher>(backplane);
    dispatcher->impl_->startThread(dispatcher->impl_);
    known = dispatcher;
  }
  return dispatcher;
}

bool Dispatcher::runOnce(Deadline deadline) { return impl_->runOnce(deadline); }
void Dispatcher::run() {
  const auto guard = impl_->becomeRunner();
  while (impl_->runOnce(Deadline::never())) {
  }
}
void Dispatcher::interrupt() noexcept { impl_->interrupt(); }
int Dispatcher::descriptor() { return impl_->descriptor(); }
bool Dispatcher::runPending(int batches) { return impl_->runPending(batches); }
Deadline Dispatcher::nextDeadline() const noexcept { return impl_->nextDue(); }
const Backplane& Dispatcher::backplane() const noexcept { return impl_->endpoint().backplane(); }

}  // namespace mpf
