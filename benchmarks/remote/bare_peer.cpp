// SPDX-License-Identifier: MIT
#include "benchmarks/remote/bare_peer.h"

#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdlib>
#include <exception>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/print_error.h"
#include "base/system_call.h"
#include "benchmarks/peers/bounced_word.h"
#include "benchmarks/remote/tcp_ends.h"
#include "benchmarks/stage/processes.h"

namespace mpf::bench {
namespace {

// Passes frames on between two words and a TCP connection, until the peer closes the connection.
class Carrier {
 public:
  Carrier(FileDescriptor connection, std::size_t frameBytes)
      : connection_(std::move(connection)), out_(frameBytes), in_(frameBytes) {}

  // Writes a frame for each value of `from`, and posts to `to` for each frame that has arrived.
  void run(const Word& from, Word& to) {
    for (std::uint32_t written = 0, arrived = 0; isOpen_; ::sched_yield()) {
      if (Spinning::has(from, written + 1)) {
        ++written;
        write();
      }
      if (hasFrame()) Asleep::post(to, ++arrived);
    }
  }

 private:
  void write() {
    for (std::size_t done = 0; done < out_.size();) {
      const auto sent = retryInterrupted([&] {
        return ::send(connection_.get(), out_.data() + done, out_.size() - done, MSG_NOSIGNAL);
      });
      done += static_cast<std::size_t>(checkCall(sent, "send", "a frame"));
    }
  }
  bool hasFrame() {
    const auto got = ::recv(connection_.get(), in_.data() + at_, in_.size() - at_, MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return false;
    isOpen_ = checkCall(got, "recv", "a frame") != 0;
    at_ += static_cast<std::size_t>(got);
    if (at_ != in_.size()) return false;
    at_ = 0;
    return true;
  }

  FileDescriptor connection_;
  std::vector<std::byte> out_, in_;
  std::size_t at_ = 0;  // position of the next byte in in_
  bool isOpen_ = true;
};

class BarePeer final : public Peer {
 public:
  BarePeer(Surroundings between, std::size_t frameBytes)
      : between_(std::move(between)), frameBytes_(frameBytes) {}

  void serve(const RunContext& context) override {
    between_.enterServer();
    const TcpListener listener(between_.serverAddress());
    auto& words = wordsOf(context).server;
    const int carrier =
        carry([&] { return listener.accept(); }, words.reply.word, words.request.word);
    context.ready(listener.port());
    bool last = false;
    for (std::uint32_t turn = 1; !last; ++turn) {
      Asleep::wait(words.request.word, turn);
      last = context.stopping();
      Spinning::post(words.reply.word, turn);
    }
    awaitEnd(carrier);
  }

  void connect(const RunContext& context) override {
    between_.enterRequester();
    context_ = &context;
    context.waitsFor("a frame from the server");
    words_ = &wordsOf(context).client;
    carrier_ =
        carry([this, port = context.port()] { return connectTcp(between_.serverAddress(), port); },
              words_->request.word, words_->reply.word);
  }
  void send() override { Spinning::post(words_->request.word, ++sent_); }
  void receive() override {
    Asleep::wait(words_->reply.word, ++received_);
    // The CPU time of the carrier counts as that of this row only after a wait for its end.
    if (context_->stopping()) killProcess(carrier_);
  }

 private:
  struct Words {
    Bounce server;
    Bounce client;
  };
  static_assert(sizeof(Words) <= kBareScratchBytes);

  static Words& wordsOf(const RunContext& context) {
    return *reinterpret_cast<Words*>(context.scratch().data());
  }
  // Starts this side's carrier, and returns its pid. It ends with this process, or when the
  // connection is closed.
  int carry(const std::function<FileDescriptor()>& connect, const Word& from, Word& to) const {
    return forkProcess([&] {
      try {
        Carrier(connect(), frameBytes_).run(from, to);
      } catch (const std::exception& error) {
        printError("a bare process: {}\n", error.what());
        std::_Exit(1);
      }
    });
  }
  // The end of this process would kill its carrier, which may still have to send the last reply.
  static void awaitEnd(int carrier) {
    int status = 0;
    retryInterrupted([&] { return ::waitpid(carrier, &status, 0); });
    if (status != 0) throw std::runtime_error("the carrier of the server failed");
  }

  Surroundings between_;
  std::size_t frameBytes_;
  const RunContext* context_ = nullptr;  // of the client; the Stage's, so it outlives this object
  Bounce* words_ = nullptr;
  int carrier_ = 0;
  std::uint32_t sent_ = 0, received_ = 0;
};

}  // namespace

std::unique_ptr<Peer> makeBarePeer(const Surroundings& between, std::size_t frameBytes) {
  return std::make_unique<BarePeer>(between, frameBytes);
}

}  // namespace mpf::bench
