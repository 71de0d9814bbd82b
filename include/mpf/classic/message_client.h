// SPDX-License-Identifier: MIT
// MessageClient in the form of the original MPF: a client of one server, with a callback that owns
// the messages that it gets.
//
//   void callback(Message* message, void* pvt) { ...; delete message; }
//   MessageClient* client = new MessageClient(callback, pvt);
//   client->bind("adc", 0);          // never waits; a ConnectMessage comes when it is connected
//   client->send(new Int32Message);
//
// The callback gets ConnectMessages, replies, and messages that answer no request. A request that
// ends without a reply comes back itself: its status is one of fateStatus, and its array is empty.
// A SerialConfigMessage, which has no status, comes back as an Int32Message.
//
// Threads  any thread may bind and send. Callbacks run one at a time on a thread of MPF, the same
//          one for all clients of the process; they may call send() and delete the client.
// Crash    when the server goes away, its requests come back, then a ConnectMessage that is not
//          connectYes comes. The client reconnects automatically.
// Trust    as mpf::MessageClient.
// Throws   nothing: a failure is printed to stderr and is a status.
// Source   manual, "Message Client". <mpf/message_client.h> has the client of new programs.
#pragma once

#include <memory>

#include <mpf/classic/message.h>

// NOLINTNEXTLINE(readability-identifier-naming): name of the manual
typedef void (*clientCallback)(Message* message, void* clientPvt);

class MessageClient {
 public:
  MessageClient(clientCallback callback, void* clientPvt);
  ~MessageClient();
  MessageClient(const MessageClient&) = delete;
  MessageClient& operator=(const MessageClient&) = delete;

  //   returns  0, or -1 when the name is not valid, the client is already bound, or the system has
  //            no memory or descriptors left
  int bind(const char* server, int location);
  // Owns the message from now on, whatever the result.
  //   returns  0 when the request was sent, so that one answer follows; otherwise -1
  int send(Message* message);
  void* getClientPvt() const { return clientPvt_; }

 private:
  class Impl;
  void* clientPvt_;
  std::unique_ptr<Impl> impl_;
};
