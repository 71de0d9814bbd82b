// SPDX-License-Identifier: MIT
// GpibParticipant: what is connected to the lines of a GpibBusModel: an instrument or a controller.
//
//   lines ──► follow() ──► what it drives ──► lines ──► follow() ... until nothing changes
//                                              └─► offer(): a byte with DAV, once all is settled
//
// Threads  GpibBusModel calls one function of one participant at a time.
#pragma once

#include "drivers/gpib/bus_lines.h"

namespace mpf {

class GpibParticipant {
 public:
  GpibParticipant() = default;
  GpibParticipant(const GpibParticipant&) = delete;
  GpibParticipant& operator=(const GpibParticipant&) = delete;
  virtual ~GpibParticipant() = default;

  // Returns what it drives now that the lines are `seen`.
  virtual GpibLines follow(const GpibLines& seen) = 0;
  // Returns what it drives after the settling time of the lines (T1): this is the time at which a
  // talker or controller may offer its next byte.
  virtual GpibLines offer(const GpibLines& seen) = 0;
};

}  // namespace mpf
