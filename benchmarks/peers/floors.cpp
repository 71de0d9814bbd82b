// SPDX-License-Identifier: MIT
// Floors: the time that the machine itself needs. No message system that uses the same means can be
// faster.
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/timing.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

using Word = std::atomic<std::uint32_t>;

struct alignas(kLineBytes) Line {
  Word word{0};
};

// Two lines, one for each direction. What the sender wrote before post() is visible after wait().
struct Bounce {
  Line request;
  Line reply;
};

struct Spinning {
  static void post(Word& word, std::uint32_t value) noexcept {
    // PAIR(bench-bounce): a process that sees the value sees everything written before it.
    word.store(value, std::memory_order_release);
  }
  static void wait(const Word& word, std::uint32_t value) noexcept {
    // PAIR(bench-bounce): see post().
    while (word.load(std::memory_order_acquire) != value) cpuRelax();
  }
};

struct Asleep {
  static void post(Word& word, std::uint32_t value) noexcept {
    Spinning::post(word, value);
    ::syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
  }
  static void wait(const Word& word, std::uint32_t value) noexcept {
    // PAIR(bench-bounce): see post().
    while (word.load(std::memory_order_acquire) != value)
      ::syscall(SYS_futex, &word, FUTEX_WAIT, value - 1, nullptr, nullptr, 0);
  }
};

// A bounce in which the server and the requester each call `work` before they post.
template <class Wait>
Act bounce(std::size_t bytes, std::function<void(std::byte*, std::byte*)> work) {
  Act act;
  act.scratchBytes = 4096 + 2 * bytes;
  act.stopsByItself = true;
  // work(from, to) is empty for the bare bounce.
  const auto buffers = [bytes](const Scene& scene) {
    return std::pair(scene.scratch().data() + 4096, scene.scratch().data() + 4096 + bytes);
  };
  act.server = [=](const Scene& scene) {
    auto& lines = *reinterpret_cast<Bounce*>(scene.scratch().data());
    const auto [request, reply] = buffers(scene);
    scene.ready();
    for (std::uint32_t turn = 1; !scene.stopping(); ++turn) {
      Wait::wait(lines.request.word, turn);
      if (work) work(request, reply);
      Wait::post(lines.reply.word, turn);
    }
  };
  act.requester = [=](const Scene& scene) {
    auto& lines = *reinterpret_cast<Bounce*>(scene.scratch().data());
    const auto [request, reply] = buffers(scene);
    std::uint32_t turn = 0;
    timeEach(scene, [&] {
      ++turn;
      if (work) work(reply, request);
      Wait::post(lines.request.word, turn);
      Wait::wait(lines.reply.word, turn);
    });
    // The server checks stopping() after its post, so it needs one more turn to end. It may also
    // have ended already.
    scene.stop();
    Wait::post(lines.request.word, ++turn);
  };
  return act;
}

// Slots of one line each, published by their sequence number; the consumer frees them in batches.
struct Slot {
  alignas(kLineBytes) std::atomic<std::uint64_t> sequence{0};
  std::uint64_t payload = 0;
};
struct RingHead {
  alignas(2 * kLineBytes) std::atomic<std::uint64_t> freed{0};
};

Act ring(std::uint64_t capacity, std::uint64_t freeEvery) {
  Act act;
  act.scratchBytes = 4096 + capacity * sizeof(Slot);
  const auto slotsOf = [](const Scene& scene) {
    return reinterpret_cast<Slot*>(scene.scratch().data() + 4096);
  };
  const auto headOf = [](const Scene& scene) -> RingHead& {
    return *reinterpret_cast<RingHead*>(scene.scratch().data());
  };
  act.server = [=](const Scene& scene) {
    auto* slots = slotsOf(scene);
    auto& freed = headOf(scene).freed;
    std::uint64_t sum = 0;
    scene.ready();
    for (std::uint64_t taken = 0;;) {
      auto& slot = slots[taken & (capacity - 1)];
      // PAIR(bench-slot-filled): once the sequence is visible, the payload is.
      while (slot.sequence.load(std::memory_order_acquire) != taken + 1) cpuRelax();
      sum += slot.payload;
      asm volatile("" : : "r"(sum));
      if (++taken % freeEvery != 0) continue;
      // PAIR(bench-slot-freed): the payloads have been read.
      freed.store(taken, std::memory_order_release);
      scene.consumed(taken);
    }
  };
  act.requester = [=](const Scene& scene) {
    auto* slots = slotsOf(scene);
    auto& freed = headOf(scene).freed;
    std::uint64_t pushed = 0;
    std::uint64_t freedSeen = 0;
    timeOneWay(scene, [&](const auto& resume) {
      while (resume()) {
        for (int i = 0; i < 4096; ++i) {
          while (pushed - freedSeen >= capacity) {
            // PAIR(bench-slot-freed): the consumer has read the slots that are overwritten next.
            freedSeen = freed.load(std::memory_order_acquire);
            if (pushed - freedSeen >= capacity) cpuRelax();
          }
          auto& slot = slots[pushed & (capacity - 1)];
          slot.payload = pushed;
          // PAIR(bench-slot-filled): the payload is written.
          slot.sequence.store(++pushed, std::memory_order_release);
        }
      }
    });
  };
  return act;
}

// memcpy in one process between its own buffers. It copies `spread` bytes before it uses the same
// buffer again.
Act copyAlone(std::size_t bytes, std::size_t spread) {
  Act act;
  act.requester = [=](const Scene& scene) {
    const auto pairs = std::max<std::size_t>(1, spread / bytes / 2);
    std::vector<std::byte> from(bytes * pairs, std::byte{1});
    std::vector<std::byte> to(bytes * pairs, std::byte{2});
    std::size_t at = 0;
    timeEach(scene, [&] {
      std::memcpy(to.data() + at * bytes, from.data() + at * bytes, bytes);
      asm volatile("" : : "r"(to.data()) : "memory");
      at = at + 1 < pairs ? at + 1 : 0;
    });
  };
  return act;
}

// The floor of connecting: a link consists of at least one segment.
Act makeSegment() {
  Act act;
  act.requester = [](const Scene& scene) {
    const std::string name = "/mpf-bench-floor-" + std::to_string(::getpid());
    timeEach(scene, [&] {
      const FileDescriptor fd(checkCall(
          ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600), "shm_open", name));
      const int failed = ::posix_fallocate(fd.get(), 0, 4096);
      void* at = failed == 0 ? ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE,
                                      MAP_SHARED | MAP_POPULATE, fd.get(), 0)
                             : MAP_FAILED;
      ::shm_unlink(name.c_str());
      if (at == MAP_FAILED) throwSystemError(failed != 0 ? failed : errno, "mmap", name);
      ::munmap(at, 4096);
    });
  };
  return act;
}

Measurement floor(const std::string& question, const std::string& name, Mode mode,
                  std::size_t bytes, const Act& act) {
  Measurement row;
  row.question = question;
  row.name = name;
  row.mode = mode;
  row.bytes = bytes;
  row.run = [act](const Stage& stage) { return stage.run(act); };
  return row;
}

}  // namespace

std::vector<Measurement> floorMeasurements() {
  const std::string question = "Floors: what the machine itself needs";
  std::vector<Measurement> rows;
  rows.push_back(floor(question, kBounce, Mode::spin, 4, bounce<Spinning>(0, {})));
  rows.push_back(floor(question, kFutexBounce, Mode::block, 4, bounce<Asleep>(0, {})));
  rows.push_back(floor(question, "cache-line stream", Mode::spin, 4, ring(4096, 1024)));
  rows.push_back(floor(question, kRing, Mode::spin, 4, ring(256, 32)));
  for (const std::size_t bytes :
       {std::size_t{1} << 10, std::size_t{1} << 16, std::size_t{1} << 20}) {
    const auto copy = [bytes](std::byte* from, std::byte* to) { std::memcpy(to, from, bytes); };
    rows.push_back(
        floor(question, kMemcpyBounce, Mode::spin, bytes, bounce<Spinning>(bytes, copy)));
    rows.push_back(
        floor(question, kFutexMemcpyBounce, Mode::block, bytes, bounce<Asleep>(bytes, copy)));
    rows.push_back(floor(question, "memcpy, cached", Mode::spin, bytes, copyAlone(bytes, 0)));
    rows.push_back(floor(question, "memcpy, cold", Mode::spin, bytes,
                         copyAlone(bytes, std::size_t{256} << 20)));
    // Only shows the cost of the peers' reading and writing compared with a memcpy.
    const auto touch = [bytes](std::byte* from, std::byte* to) {
      readAll(from, bytes);
      writeAll(to, bytes);
    };
    rows.push_back(
        floor(question, "touch bounce", Mode::spin, bytes, bounce<Spinning>(bytes, touch)));
  }
  for (auto& row : rows) row.touched = row.bytes >= 1024;
  rows.push_back(floor(question, "one segment made", Mode::block, 4096, makeSegment()));
  return rows;
}

}  // namespace mpf::bench
