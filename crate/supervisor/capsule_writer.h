// SPDX-License-Identifier: MIT
// CapsuleWriter: writes a capsule when a process of the crate dies, or is ended because it is
// stalled, busy or restarted.
//
//   watch(), look() ─► SegmentWitness        the process dies ─► collect() ─► CapsuleStore
//
// Threads  one.
#pragma once

#include <poll.h>

#include <map>
#include <string>
#include <vector>

#include "crate/capsule/capsule_store.h"
#include "crate/capsule/segment_witness.h"
#include "crate/supervisor/crate_folder.h"
#include "crate/supervisor/service.h"

namespace mpf::crate {

class CapsuleWriter {
 public:
  CapsuleWriter(const CrateFolder& folder, const Crate& crate)
      : folder_(folder), crate_(crate.name), store_(storeOf(crate)) {}
  // Takes the limits of a crate that was read again.
  void setLimits(const Crate& crate) { store_ = storeOf(crate); }

  // Adds its descriptors to those for poll(); when one is readable, look() is due.
  void addTo(std::vector<pollfd>& polled) const;
  // Call about once a second, too.
  void look();
  // Call when a process has been started or taken over.
  void watch(const Service& service);
  void forget(const Service& service);
  // Call when the process of `service` has ended, before Service::ended() and before its files are
  // removed. Returns the path of the capsule; empty: its stop was requested, a start has
  // failed as the one before, or the capsule could not be written, which has been reported.
  std::string collect(const Service& service, const ProcessEnd& end);

 private:
  [[nodiscard]] CapsuleStore storeOf(const Crate& crate) const {
    return CapsuleStore(folder_.file("capsules"), static_cast<std::size_t>(crate.maxCapsules),
                        crate.maxCapsuleBytes);
  }
  std::string write(const Service& service, const ProcessEnd& end);

  CrateFolder folder_;
  std::string crate_;
  CapsuleStore store_;
  std::map<std::string, SegmentWitness> witnesses_;  // by backplane
};

}  // namespace mpf::crate
