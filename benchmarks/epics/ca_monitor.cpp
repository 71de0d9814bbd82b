// SPDX-License-Identifier: MIT
// A file of its own: <cadef.h> and <dbAccess.h> define the same names.
#include "benchmarks/epics/ca_monitor.h"

#include <cadef.h>
#include <stdexcept>

namespace mpf::bench {
namespace {

void check(int status) {
  if (status != ECA_NORMAL) throw std::runtime_error(ca_message(status));
}

}  // namespace

CaMonitor::CaMonitor(const std::string& record) {
  constexpr double kConnectSeconds = 10;
  check(ca_context_create(ca_enable_preemptive_callback));
  chid channel = nullptr;
  check(ca_create_channel(record.c_str(), nullptr, nullptr, 0, &channel));
  check(ca_pend_io(kConnectSeconds));
  check(ca_create_subscription(DBR_LONG, 1, channel, DBE_VALUE, onValue, this, nullptr));
  ca_flush_io();
}

void CaMonitor::waitFor(std::int32_t value) {
  while (last_ != value) arrived_.acquire();
}

void CaMonitor::onValue(event_handler_args event) {
  auto& self = *static_cast<CaMonitor*>(event.usr);
  if (event.status != ECA_NORMAL) return;
  self.last_ = *static_cast<const dbr_long_t*>(event.dbr);
  self.arrived_.release();
}

}  // namespace mpf::bench
