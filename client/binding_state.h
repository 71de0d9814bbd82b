// SPDX-License-Identifier: MIT
// BindingState: where a binding is between bind() and the end of its client.
//
//   unbound ─bind─► waiting ─server found─► connecting ─accepted─► connected
//                      ▲                        │                      │
//                      │                        └─ server gone, refused, protocol error
//                      │                                               ▼
//                      └──────── remaining messages and fates ────── ending
//                                     delivered                       │ ▲
//                                                a callback has thrown ▼ │ onTime()
//                                                                 interrupted
//
//   every state ─client destroyed─► left
#pragma once

namespace mpf {

enum class BindingState {
  unbound,
  // There is no link; the client connects when its server appears, or at the next attempt.
  waiting,
  // The link exists, and the server has not accepted it yet.
  connecting,
  connected,
  // disconnect() delivers what remains of the connection.
  ending,
  // A callback has thrown within disconnect(); onTime() continues it.
  interrupted,
  // No callback runs any more.
  left,
};

}  // namespace mpf
