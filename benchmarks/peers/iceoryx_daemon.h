// SPDX-License-Identifier: MIT
// IceoryxDaemon: RouDi, without which nothing of iceoryx works, for the time of its measurements.
#pragma once

#include <string>

#include "benchmarks/peers/peer.h"

namespace mpf::bench {

class IceoryxDaemon final : public Environment {
 public:
  // Returns when it is ready for clients.
  //   throws  std::runtime_error: not installed, another one runs already, not ready within 10 s
  IceoryxDaemon();
  ~IceoryxDaemon() override;
  IceoryxDaemon(const IceoryxDaemon&) = delete;
  IceoryxDaemon& operator=(const IceoryxDaemon&) = delete;

 private:
  void stop() noexcept;
  int pid_ = 0;
  std::string config_;
};

}  // namespace mpf::bench
