// SPDX-License-Identifier: MIT
// IceoryxDaemon: runs RouDi, the daemon that iceoryx needs, during the measurements of iceoryx.
#pragma once

#include <string>

#include "benchmarks/peers/peer.h"

namespace mpf::bench {

class IceoryxDaemon final : public Environment {
 public:
  // Returns when the daemon is ready for clients.
  //   throws  std::runtime_error when it is not installed, another one is running, or it is not
  //           ready within 10 s
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
