// SPDX-License-Identifier: MIT
// MessageServer in the form of the original MPF: a named server, which owns the messages that it
// receives.
//
//   MessageServer* server = new MessageServer("adc", 20);
//   while (true) {
//     server->waitForMessage();
//     Message* message;
//     while ((message = server->receive())) { ...; server->reply(message); }
//   }
//
// A server replies with the request itself, changed, or with messages of allocReplyMessage(), now
// or later, as often as it likes as long as it keeps the request or such a message. A request is
// refused, so that its client gets an answer, when it and all messages that were made for it are
// deleted without a reply.
//
// Threads  one thread waits and receives; any thread may call allocReplyMessage() and reply().
// Crash    as mpf::MessageServer.
// Trust    as mpf::MessageServer.
// Throws   nothing: a failure is printed to stderr and is a status.
// Source   manual, "Message Server". <mpf/message_server.h> has the server of new programs.
#pragma once

#include <memory>

#include <mpf/classic/message.h>

class MessageServer {
 public:
  // Serves at the location MPF_LOCATION, or 0. When another process has the name, the reason is
  // printed, and waitForMessage() tries again every second.
  //   queueSize  requests of one client that may wait, limited to 1 to 16384
  explicit MessageServer(const char* name, int queueSize = 100);
  // Messages of the server may outlive it.
  ~MessageServer();
  MessageServer(const MessageServer&) = delete;
  MessageServer& operator=(const MessageServer&) = delete;

  void waitForMessage();
  // The next request, or null when no request waits.
  Message* receive();
  // A message of the given type for the client of `clientMessage`, which was received or made by
  // this function; null for a number that is not in messageType.
  Message* allocReplyMessage(Message* clientMessage, messageType type);
  // Owns the message from now on, whatever the result.
  //   returns  0 when it was sent; -1 when the client is gone, its queue is full, or the message is
  //            no reply or too large
  int reply(Message* message);
  // For clients that connect from now on.
  void setQueueSize(int size);
  const char* getName() const;
  // Prints what msr prints.
  void report() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};
