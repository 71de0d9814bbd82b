// SPDX-License-Identifier: MIT
// LinkRecord: counters and last messages of a link, decoded from its open file.
//
// Threads  one.
// Trust    the file may contain anything: what cannot be read is a "problem" in the record.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "crate/capsule/segment_witness.h"

namespace mpf::crate {

using Tree = nlohmann::ordered_json;

struct LinkRecord {
  Tree tree;
  // The request that the server took last, if the ring still has it.
  std::optional<Tree> lastTaken;

  // last: number of messages of each ring.
  static LinkRecord of(const WitnessedLink& link, std::size_t last);
};

}  // namespace mpf::crate
