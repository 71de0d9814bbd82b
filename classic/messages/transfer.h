// SPDX-License-Identifier: MIT
// Transfer: moves messages between the form of <mpf/classic.h> and that of <mpf/message.h>.
//
//   mpf::Message ── receive() ──► Message, with the route in its request_
//   mpf::Message ◄── send() ───── Message
//
// A route with a keeper refuses its request when its last handle is destroyed. Old servers delete a
// request before they send the reply that they made for it, so the request and such replies share
// one empty handle with the route.
//
// Threads  as Message.
#pragma once

#include <memory>

#include <mpf/classic/message.h>

namespace mpf::classic {

class Transfer {
 public:
  // Returns null, and leaves `message` unchanged, when its type does not exist in the old form or
  // its body is invalid.
  //   throws  std::bad_alloc
  [[nodiscard]] static std::unique_ptr<::Message> receive(Message&& message);
  // The message for the transport, with the route of its request, but without its keeper. An array
  // loses its elements.
  //   throws  std::bad_alloc
  [[nodiscard]] static Message send(::Message& message);
  // As MessageServer::allocReplyMessage().
  //   throws  std::bad_alloc
  [[nodiscard]] static std::unique_ptr<::Message> makeReply(const ::Message& request,
                                                            messageType type);
  // The message that stands for a request without a reply: `request`, after send(), with a status.
  //   throws  std::bad_alloc
  [[nodiscard]] static std::unique_ptr<::Message> withFate(std::unique_ptr<::Message> request,
                                                           Fate fate);
};

}  // namespace mpf::classic
