// SPDX-License-Identifier: MIT
#include <mpf/drivers/gpib/gpib_bus.h>

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "drivers/gpib/bus_turns.h"
#include "drivers/gpib/handler_list.h"
#include "drivers/gpib/service_request_watch.h"

namespace mpf {
namespace {

constexpr std::chrono::seconds kStartLimit{3};
constexpr std::chrono::milliseconds kLineLimit{100};  // for a look at the SRQ line

}  // namespace

class GpibBus::Impl {
 public:
  Impl(std::unique_ptr<GpibController> controller, const GpibBusOptions& options)
      : controller_(std::move(controller)) {
    start("interface clear", controller_->interfaceClear(Deadline::after(kStartLimit)));
    start("remote enable", controller_->remoteEnable(true, Deadline::after(kStartLimit)));
    requests_.emplace([this] { return isServiceRequested(); }, options.pollServiceRequestEvery);
    requests_->setReported(controller_->onServiceRequest([this] { requests_->report(); }));
  }
  ~Impl() {
    controller_->onServiceRequest({});
    requests_.reset();
    controller_->onPeek({});
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // Calls `act` with the controller when it is the turn of `user`.
  template <class Act>
  std::invoke_result_t<Act, GpibController&> perform(GpibUser user, Deadline deadline, Act act) {
    std::invoke_result_t<Act, GpibController&> result;
    static_cast<GpibResult&>(result) = turns_.take(user, deadline);
    if (!result.ok()) return result;
    const Turn turn(turns_);
    followTaps();
    return act(*controller_);
  }

  BusTurns& turns() noexcept { return turns_; }
  const GpibController& controller() const noexcept { return *controller_; }
  std::shared_ptr<void> addTap(GpibPeekHandler handler) { return taps_.add(std::move(handler)); }
  std::shared_ptr<void> addServiceRequest(std::function<void()> handler) {
    return requests_->add(std::move(handler));
  }

 private:
  // Gives the turn back, also when the controller throws.
  class Turn {
   public:
    explicit Turn(BusTurns& turns) noexcept : turns_(turns) {}
    ~Turn() { turns_.give(); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    BusTurns& turns_;
  };

  // A controller that has no such line (USBTMC) needs no start.
  void start(const char* what, const GpibResult& result) const {
    if (result.ok() || result.status == GpibStatus::unsupported) return;
    throw std::runtime_error(fmt::format("{} cannot start, {} failed: {}",
                                         controller_->description(), what, result.reason));
  }
  // The controller accepts a change of its peek handler between operations only, so a change of the
  // taps takes effect when the next operation begins.
  void followTaps() {
    const bool isTapped = !taps_.isEmpty();
    if (std::exchange(isPeeking_, isTapped) == isTapped) return;
    if (isTapped) {
      controller_->onPeek([this](std::span<const GpibPeekedByte> bytes) { taps_.call(bytes); });
    } else {
      controller_->onPeek({});
    }
  }
  // Empty: the bus was busy, or the controller could not tell.
  [[nodiscard]] std::optional<bool> isServiceRequested() {
    if (!turns_.take(BusTurns::kBusItself, Deadline::after(kLineLimit)).ok()) return std::nullopt;
    const Turn turn(turns_);
    return controller_->requestsService(Deadline::after(kLineLimit));
  }

  const std::unique_ptr<GpibController> controller_;
  BusTurns turns_;
  HandlerList<std::span<const GpibPeekedByte>> taps_;
  bool isPeeking_ = false;  // the thread that has the turn
  std::optional<ServiceRequestWatch> requests_;  // last: its thread uses the others
};

GpibBus::GpibBus(std::unique_ptr<GpibController> controller, GpibBusOptions options)
    : impl_(std::make_unique<Impl>(std::move(controller), options)) {}

GpibBus::~GpibBus() = default;

GpibResult GpibBus::write(const GpibAddress& to, Bytes data, Deadline deadline, GpibUser user,
                          bool sendEnd) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.write(to, data, sendEnd, deadline);
  });
}

GpibReadResult GpibBus::read(const GpibAddress& from, const GpibReadLimits& limits,
                             Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.read(from, limits, deadline);
  });
}

GpibReadResult GpibBus::writeRead(const GpibAddress& at, Bytes data, const GpibReadLimits& limits,
                                  Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    auto written = controller.write(at, data, true, deadline);
    if (written.ok()) return controller.read(at, limits, deadline);
    GpibReadResult result;
    static_cast<GpibResult&>(result) = std::move(written);
    return result;
  });
}

GpibResult GpibBus::sendCommands(Bytes commands, Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.sendCommands(commands, deadline);
  });
}

GpibPollResult GpibBus::serialPoll(const GpibAddress& at, Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.serialPoll(at, deadline);
  });
}

GpibResult GpibBus::clearAll(Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline,
                        [&](GpibController& controller) { return controller.clearAll(deadline); });
}

GpibResult GpibBus::clear(const GpibAddress& at, Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline,
                        [&](GpibController& controller) { return controller.clear(at, deadline); });
}

GpibResult GpibBus::trigger(std::span<const GpibAddress> at, Deadline deadline, GpibUser user) {
  return impl_->perform(
      user, deadline, [&](GpibController& controller) { return controller.trigger(at, deadline); });
}

GpibResult GpibBus::interfaceClear(Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.interfaceClear(deadline);
  });
}

GpibResult GpibBus::remoteEnable(bool on, Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.remoteEnable(on, deadline);
  });
}

GpibResult GpibBus::localLockout(Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.localLockout(deadline);
  });
}

GpibResult GpibBus::goToLocal(const GpibAddress& at, Deadline deadline, GpibUser user) {
  return impl_->perform(user, deadline, [&](GpibController& controller) {
    return controller.goToLocal(at, deadline);
  });
}

GpibResult GpibBus::lease(GpibUser user, std::string name, Milliseconds limit, Deadline deadline) {
  return impl_->turns().lease(user, std::move(name), limit, deadline);
}

void GpibBus::release(GpibUser user) noexcept { impl_->turns().release(user); }

std::optional<GpibLeaseHolder> GpibBus::leaseHolder() const { return impl_->turns().holder(); }

GpibBus::Subscription GpibBus::onServiceRequest(std::function<void()> handler) {
  return Subscription(impl_->addServiceRequest(std::move(handler)));
}

GpibBus::Subscription GpibBus::attachTap(GpibPeekHandler handler) {
  return Subscription(impl_->addTap(std::move(handler)));
}

std::string GpibBus::description() const { return impl_->controller().description(); }

}  // namespace mpf
