// SPDX-License-Identifier: MIT
// GpibParticipant: what is connected to the lines of a GpibBusModel: an instrument or a controller.
//
//   lines ──► follow() ──► what it drives ──► lines ──► follow() ... until nothing changes;
//   then offer() ──► it has a byte ──► follow() ──► DAV ──► lines ──► follow() ...
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
  // Called after the settling time of the lines (T1): a talker or controller may offer its next
  // byte now. Returns whether it does: then follow() drives it.
  virtual bool offer(const GpibLines& seen) = 0;
};

}  // namespace mpf
