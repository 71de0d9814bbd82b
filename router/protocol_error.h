// SPDX-License-Identifier: MIT
// ProtocolError: a violation of the protocol or of a limit by the peer, which ends the connection.
#pragma once

#include <kj/time.h>
#include <stdexcept>

#include "schema/router.capnp.h"

namespace mpf::router {

using FarewellCode = wire::Farewell::Code;

// How long a peer has to receive a farewell and to close the connection.
inline constexpr auto kFarewellTime = 500 * kj::MILLISECONDS;

class ProtocolError : public std::runtime_error {
 public:
  ProtocolError(FarewellCode code, const std::string& text)
      : std::runtime_error(text), code_(code) {}
  [[nodiscard]] FarewellCode code() const noexcept { return code_; }

 private:
  FarewellCode code_;
};

}  // namespace mpf::router
