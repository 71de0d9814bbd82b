// SPDX-License-Identifier: MIT
// Aeron through its client in C: aeron:ipc with one exclusive publication in each direction, as in
// peers/aeron/AeronPeer.java. The media driver runs in the process of the server, with one thread
// that sleeps when it has no work. No message passes it.
#include <aeron/aeronc.h>
#include <aeronmd/aeronmd.h>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

constexpr std::int32_t kRequests = 1;
constexpr std::int32_t kReplies = 2;
constexpr std::size_t kFragments = 64;   // of one poll, at most
constexpr std::size_t kLongest = 4096;   // that is written in place
constexpr auto kAnswerLimit = std::chrono::seconds(10);

void checkAeron(int result, const char* call) {
  if (result < 0) throw std::runtime_error(std::string(call) + ": " + aeron_errmsg());
}

class AeronClientPeer final : public Peer {
 public:
  explicit AeronClientPeer(PeerOptions options) : options_(std::move(options)) {}

  void serve(const RunContext& context) override {
    startDriver();
    open(kReplies, kRequests);
    context.ready();
    for (bool last = false; !last;) {
      while (pending_ == 0) poll();
      last = context.stopping();
      for (; pending_ > 0; --pending_) put();
    }
    // The requester has to read the last reply before the driver ends with this process.
    sleepFor(std::chrono::milliseconds(20));
  }
  void connect(const RunContext&) override {
    open(kRequests, kReplies);
    waitFor([this] {
      return aeron_exclusive_publication_is_connected(out_) &&
             aeron_subscription_is_connected(back_);
    });
  }
  void send() override { put(); }
  void receive() override {
    while (pending_ == 0) poll();
    --pending_;
  }

  void sink(const RunContext& context) override {
    startDriver();
    open(0, kRequests);
    context.ready();
    for (;;) {
      poll();
      context.consumed(pending_);
    }
  }
  void flood(const RunContext&, const std::function<bool()>& resume) override {
    open(kRequests, 0);
    waitFor([this] { return aeron_exclusive_publication_is_connected(out_); });
    while (resume()) {
      for (int i = 0; i < 64; ++i) put();
    }
  }
  void removeTraces() noexcept override {
    std::error_code ignored;
    std::filesystem::remove_all(folder(), ignored);
  }

 private:
  [[nodiscard]] std::string folder() const { return "/dev/shm/" + options_.name + ".aeron"; }
  [[nodiscard]] bool isShort() const { return options_.bytes <= kLongest; }
  [[nodiscard]] std::string channel() const {
    return std::string("aeron:ipc?term-length=64m|mtu=") + (isShort() ? "8192" : "65504");
  }

  void startDriver() {
    aeron_driver_context_t* context = nullptr;
    checkAeron(aeron_driver_context_init(&context), "aeron_driver_context_init");
    checkAeron(aeron_driver_context_set_dir(context, folder().c_str()),
               "aeron_driver_context_set_dir");
    aeron_driver_context_set_threading_mode(context, AERON_THREADING_MODE_SHARED);
    aeron_driver_context_set_term_buffer_sparse_file(context, false);
    aeron_driver_t* driver = nullptr;
    checkAeron(aeron_driver_init(&driver, context), "aeron_driver_init");
    checkAeron(aeron_driver_start(driver, false), "aeron_driver_start");
  }

  //   outStream, backStream  0: none
  void open(std::int32_t outStream, std::int32_t backStream) {
    aeron_context_t* context = nullptr;
    checkAeron(aeron_context_init(&context), "aeron_context_init");
    checkAeron(aeron_context_set_dir(context, folder().c_str()), "aeron_context_set_dir");
    aeron_context_set_pre_touch_mapped_memory(context, true);
    aeron_t* client = nullptr;
    checkAeron(aeron_init(&client, context), "aeron_init");
    checkAeron(aeron_start(client), "aeron_start");
    if (backStream != 0) subscribe(client, backStream);
    if (outStream != 0) publish(client, outStream);
    checkAeron(aeron_fragment_assembler_create(&assembler_, &AeronClientPeer::take, this),
               "aeron_fragment_assembler_create");
    buffer_.assign(options_.bytes, std::uint8_t{1});
  }
  void subscribe(aeron_t* client, std::int32_t stream) {
    aeron_async_add_subscription_t* adding = nullptr;
    checkAeron(aeron_async_add_subscription(&adding, client, channel().c_str(), stream, nullptr,
                                            nullptr, nullptr, nullptr),
               "aeron_async_add_subscription");
    waitFor([&] {
      const int done = aeron_async_add_subscription_poll(&back_, adding);
      checkAeron(done, "aeron_async_add_subscription_poll");
      return done == 1;
    });
  }
  void publish(aeron_t* client, std::int32_t stream) {
    aeron_async_add_exclusive_publication_t* adding = nullptr;
    checkAeron(aeron_async_add_exclusive_publication(&adding, client, channel().c_str(), stream),
               "aeron_async_add_exclusive_publication");
    waitFor([&] {
      const int done = aeron_async_add_exclusive_publication_poll(&out_, adding);
      checkAeron(done, "aeron_async_add_exclusive_publication_poll");
      return done == 1;
    });
  }
  template <class Done>
  static void waitFor(const Done& done) {
    if (!waitUntil(done, kAnswerLimit)) throw std::runtime_error("no answer of the media driver");
  }

  void put() {
    if (isShort()) {
      aeron_buffer_claim_t claim{};
      while (aeron_exclusive_publication_try_claim(out_, options_.bytes, &claim) < 0) cpuRelax();
      if (options_.touch) writeAll(claim.data, options_.bytes);
      aeron_buffer_claim_commit(&claim);
    } else {
      if (options_.touch) writeAll(buffer_.data(), buffer_.size());
      while (aeron_exclusive_publication_offer(out_, buffer_.data(), buffer_.size(), nullptr,
                                               nullptr) < 0)
        cpuRelax();
    }
  }
  void poll() {
    const int taken = isShort()
                          ? aeron_subscription_poll(back_, &AeronClientPeer::take, this, kFragments)
                          : aeron_subscription_poll(back_, aeron_fragment_assembler_handler,
                                                    assembler_, kFragments);
    checkAeron(taken, "aeron_subscription_poll");
    if (taken == 0) cpuRelax();
  }
  static void take(void* self, const std::uint8_t* bytes, std::size_t length, aeron_header_t*) {
    auto& peer = *static_cast<AeronClientPeer*>(self);
    if (peer.options_.touch) readAll(bytes, length);
    ++peer.pending_;
  }

  PeerOptions options_;
  aeron_exclusive_publication_t* out_ = nullptr;
  aeron_subscription_t* back_ = nullptr;
  aeron_fragment_assembler_t* assembler_ = nullptr;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t pending_ = 0;  // messages that were received and not yet answered or counted
};

}  // namespace

PeerFamily aeronClientPeer() {
  PeerFamily family;
  family.name = "Aeron (C)";
  family.modes = {Mode::spin};
  family.make = [](const PeerOptions& options) {
    return std::make_unique<AeronClientPeer>(options);
  };
  family.oneWay = true;
  return family;
}

}  // namespace mpf::bench
