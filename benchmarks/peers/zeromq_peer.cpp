// SPDX-License-Identifier: MIT
// ZeroMQ: a pair of PAIR sockets over ipc://, its fastest pattern between two processes. Each
// message passes an I/O thread on each side, which shares the CPU with the caller. Therefore it has
// no spin mode: a caller that polls would keep its own I/O thread from running.
#include <cstring>
#include <stdexcept>
#include <zmq.h>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/touch.h"

namespace mpf::bench {
namespace {

int check(int result, const char* call) {
  if (result < 0) throw std::runtime_error(std::string(call) + ": " + zmq_strerror(zmq_errno()));
  return result;
}

class ZeromqPeer final : public Peer {
 public:
  explicit ZeromqPeer(PeerOptions options) : options_(std::move(options)) {}
  ~ZeromqPeer() override {
    if (socket_ != nullptr) zmq_close(socket_);
    if (context_ != nullptr) zmq_ctx_term(context_);
  }
  ZeromqPeer(const ZeromqPeer&) = delete;
  ZeromqPeer& operator=(const ZeromqPeer&) = delete;

  void serve(const RunContext& context) override {
    bind(context);
    for (bool last = false; !last;) {
      take();
      last = context.stopping();
      put();
    }
    // Sends the last reply before the process exits.
    close();
  }
  void connect(const RunContext&) override {
    open();
    check(zmq_connect(socket_, address().c_str()), "zmq_connect");
  }
  void send() override { put(); }
  void receive() override { take(); }

  void sink(const RunContext& context) override {
    bind(context);
    for (std::uint64_t taken = 0;;) {
      take();
      if (++taken % 64 == 0) context.consumed(taken);
    }
  }
  void flood(const RunContext& context, const std::function<bool()>& resume) override {
    connect(context);
    while (resume()) {
      for (int i = 0; i < 64; ++i) put();
    }
  }

 private:
  [[nodiscard]] std::string address() const { return "ipc://@" + options_.name; }
  void open() {
    context_ = zmq_ctx_new();
    socket_ = zmq_socket(context_, ZMQ_PAIR);
    if (socket_ == nullptr) check(-1, "zmq_socket");
    const int linger = 100;
    check(zmq_setsockopt(socket_, ZMQ_LINGER, &linger, sizeof linger), "zmq_setsockopt");
  }
  void close() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
    socket_ = nullptr;
    context_ = nullptr;
  }
  void bind(const RunContext& context) {
    open();
    check(zmq_bind(socket_, address().c_str()), "zmq_bind");
    context.ready();
  }

  void put() {
    zmq_msg_t message;
    check(zmq_msg_init_size(&message, options_.bytes), "zmq_msg_init_size");
    if (options_.touch) writeAll(zmq_msg_data(&message), options_.bytes);
    check(zmq_msg_send(&message, socket_, 0), "zmq_msg_send");
  }
  void take() {
    zmq_msg_t message;
    zmq_msg_init(&message);
    check(zmq_msg_recv(&message, socket_, 0), "zmq_msg_recv");
    if (options_.touch) readAll(zmq_msg_data(&message), options_.bytes);
    zmq_msg_close(&message);
  }

  PeerOptions options_;
  void* context_ = nullptr;
  void* socket_ = nullptr;
};

}  // namespace

PeerFamily zeromqPeer() {
  PeerFamily family;
  family.name = "ZeroMQ";
  family.modes = {Mode::block};
  family.make = [](const PeerOptions& options) { return std::make_unique<ZeromqPeer>(options); };
  family.oneWay = true;
  return family;
}

}  // namespace mpf::bench
