// SPDX-License-Identifier: MIT
// Peers whose libraries were not installed at build time: their rows are left out with this reason.
#include "benchmarks/peers/peer.h"

namespace mpf::bench {
namespace {

[[maybe_unused]] PeerFamily missing(const char* name, const char* package) {
  PeerFamily family;
  family.name = name;
  family.skipped = std::string("not installed at build time (") + package + ")";
  family.modes = {Mode::block};
  return family;
}

}  // namespace

#ifndef MPF_BENCH_ZEROMQ
PeerFamily zeromqPeer() { return missing("ZeroMQ", "libzmq3-dev"); }
#endif
#ifndef MPF_BENCH_ICEORYX
PeerFamily iceoryxPeer() { return missing("iceoryx 2.0", "libiceoryx-posh-dev"); }
#endif
#ifndef MPF_BENCH_AERON
PeerFamily aeronClientPeer() {
  return missing("Aeron (C)", "Aeron's libaeron and libaeron_driver");
}
#endif

}  // namespace mpf::bench
