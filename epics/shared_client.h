// SPDX-License-Identifier: MIT
// SharedClient: the client of one server that all records of the IOC with this server share. The
// clientType of a message says which record it belongs to, and what happens with the reply. A
// request ends at the record that sent it, also if the server has changed the clientType.
//
//   record ── send() ──► | backlog | ──► MessageClient ──► server
//   record ◄── Member::deliver() ◄────── MessageClient ◄── replies, fates, connections
//
// When the queue of the server is full, messages wait in the backlog until earlier requests end.
// A message whose deadline passes there expires, also behind messages that may wait longer.
//
// Threads  any. deliver() runs on the dispatcher's thread, or in add(); it must not call this
//          object.
// Crash    each message that send() accepted ends in a reply or a fate, also from the backlog.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include <mpf/epics/dev_mpf.h>
#include <mpf/message_client.h>

namespace mpf {

class SharedClient {
 public:
  // A record of the connection. It outlives the connection.
  class Member {
   public:
    // An empty message: isServerStopped() has changed.
    virtual void deliver(Message&& message) noexcept = 0;

   protected:
    ~Member() = default;
  };

  static constexpr std::size_t kMaxBacklog = 65'536;

  // The dispatcher outlives the client.
  SharedClient(Dispatcher& dispatcher, std::string server, std::int32_t location);
  ~SharedClient() { close(); }
  SharedClient(const SharedClient&) = delete;
  SharedClient& operator=(const SharedClient&) = delete;

  // A member that is added when the server is connected gets a ConnectMessage at once.
  //   returns  the number of the member, for send()
  [[nodiscard]] std::uint32_t add(Member& member);
  // Starts to connect. Calls after the first have no effect.
  void bind();
  // Tells the members that the server is not connected, if it is not: no server may ever have been
  // there.
  void reportAbsence();
  // Empties `message` when the result is `sent`.
  //   requestId  out: the number of the request as soon as it is known, for cancel(); outlives the
  //              request
  [[nodiscard]] SendResult send(std::uint32_t member, ReplyType reply, Message&& message,
                                Deadline deadline, std::atomic<std::uint32_t>& requestId);
  void cancel(std::uint32_t requestId);
  // Sends what waits in the backlog, and ends requests whose deadline has passed there.
  void serveBacklog();
  // Ends the client: nothing is delivered after it.
  void close();

  // Whether the process of the server is stopped, so that it sends nothing. The answer of
  // isServerStopped() is false again after each connection and disconnection.
  void setServerStopped(bool isStopped);
  [[nodiscard]] bool isServerStopped() const noexcept {
    return isServerStopped_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::int32_t serverPid() const;

  [[nodiscard]] bool isConnected() const;
  [[nodiscard]] std::string notConnectedBecause() const;
  [[nodiscard]] const std::string& server() const noexcept { return server_; }
  [[nodiscard]] std::int32_t location() const noexcept { return location_; }
  [[nodiscard]] std::size_t members() const;

  [[nodiscard]] static ReplyType replyTypeOf(const Message& message) noexcept {
    return static_cast<ReplyType>(message.getClientType() & 3);
  }

 private:
  struct Waiting {
    Message message;
    Deadline deadline;
    std::atomic<std::uint32_t>* requestId;
  };
  void onMessage(Message&& message);
  void onConnect(const Connect& connect);
  void endExpired();
  bool trySendFirst();
  // As MessageClient::send(). The caller holds the mutex.
  SendResult sendLocked(Message& message, Deadline deadline, std::atomic<std::uint32_t>& requestId);
  void restoreClientType(Message& message);
  void endBacklog(Fate fate);
  // To the member that the message is for. The caller holds the mutex.
  void deliverLocked(Message&& message) noexcept;

  const std::string server_;
  const std::int32_t location_;
  mutable std::mutex mutex_;
  std::unique_ptr<MessageClient> client_;  // all below under mutex_
  std::vector<Member*> members_;
  std::deque<Waiting> backlog_;
  // Of the requests that were sent and have not ended, by their number.
  std::unordered_map<std::uint32_t, std::int32_t> clientTypes_;
  Deadline nextDeadline_ = Deadline::never();  // none in the backlog is earlier
  bool isBound_ = false;
  bool isConnected_ = false;  // as the members were last told
  std::atomic<bool> hasBacklog_{false};
  std::atomic<bool> isServerStopped_{false};  // written under mutex_
};

}  // namespace mpf
