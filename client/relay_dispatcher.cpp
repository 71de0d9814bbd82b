// SPDX-License-Identifier: MIT
#include "client/relay_dispatcher.h"

#include "client/dispatcher_impl.h"

namespace mpf {

void RelayDispatcher::setPolled(bool isPolled) noexcept { impl_->endpoint().setPolled(isPolled); }

bool RelayDispatcher::runSome(int batches) { return impl_->runSome(batches); }

}  // namespace mpf
