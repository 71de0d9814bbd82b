// SPDX-License-Identifier: MIT
// GpibServer: the requests of many clients to the instruments of one bus, as described in
// include/mpf/gpib_commands.h.
//
//   clients ──► server's thread ──► GpibRequestQueue ──► bus thread ──► GpibBus
//           ◄── expired, leases and ──┘                      │
//               subscriptions of dead clients                │
//           ◄── replies, OutOfBand messages ─────────────────┘
//
// The server's thread never waits for the bus, so that a request ends at its timeout, and a lease
// ends with its holder, even while an instrument hangs.
//
// Threads  its two threads; one thread constructs, starts and destroys it.
// Crash    the requests of a client that dies are dropped unless they have begun; its lease and its
//          subscriptions end.
// Trust    gpib_request.h. The bus is never occupied by one request for longer than maxTimeout.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <set>

#include <mpf/drivers/gpib/gpib_bus.h>
#include <mpf/message_server.h>

#include "server/programs/gpib_server/gpib_operations.h"
#include "server/programs/gpib_server/request_queue.h"
#include "server/programs/gpib_server/service_subscriptions.h"
#include "server/programs/server_log.h"
#include "server/programs/serving_thread.h"

namespace mpf {

class GpibServer {
 public:
  // Sets the handlers of `server`: it performs Char8Array requests and replies to other types with
  // status -1.
  //   server, bus, log  must outlive this object
  GpibServer(MessageServer& server, GpibBus& bus, const GpibLimits& limits, const ServerLog& log);
  // Stops, and waits for the operation in progress, at most until its timeout. Requests that have
  // not begun end as `refused`.
  ~GpibServer();
  GpibServer(const GpibServer&) = delete;
  GpibServer& operator=(const GpibServer&) = delete;

  // Serves until stop(). `failed` is called, on any thread, when the server has
  // failed, after it has logged the error.
  void start(const std::function<void()>& failed);
  // No request begins any more. Any thread; does not wait.
  void stop();

 private:
  // The request of the client that has the lease: it shows whether the client is still there.
  struct Lease {
    Char8ArrayMessage request;
    GpibUser client = 0;
  };

  void receive();
  void handle(Char8ArrayMessage&& message);
  void endExpired();
  void forgetGone();
  void reply(const Char8ArrayMessage& request, const GpibReply& reply);
  [[nodiscard]] GpibReply notBegun(const GpibWork& work) const;
  [[nodiscard]] GpibReply holder() const;

  void serveBus();
  void perform(GpibWork&& work);
  void keepLease(Char8ArrayMessage&& request, GpibUser client);
  void note(const GpibWork& work, const GpibReply& reply);

  MessageServer& server_;
  GpibBus& bus_;
  const GpibLimits limits_;
  const ServerLog& log_;
  GpibRequestQueue queue_;
  ServiceSubscriptions subscriptions_;
  std::mutex mutex_;
  std::optional<Lease> lease_;  // under mutex_; the last one, which may have ended
  std::set<GpibAddress> failing_;  // the bus thread: instruments whose last request failed
  std::atomic<bool> ends_{false};
  ServingThread receiving_;
  ServingThread serving_;
};

}  // namespace mpf
