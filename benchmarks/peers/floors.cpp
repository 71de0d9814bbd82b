// SPDX-License-Identifier: MIT
// Floors: the time that the machine itself needs. No message system that uses the same means can be
// faster.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/peers/bounced_word.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/timing.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

// A bounce in which the server and the requester each call `work` before they post.
template <class Wait>
Workload bounce(std::size_t bytes, std::function<void(std::byte*, std::byte*)> work) {
  Workload workload;
  workload.scratchBytes = 4096 + 2 * bytes;
  workload.stopsByItself = true;
  // work(from, to) is empty for the bare bounce.
  const auto buffers = [bytes](const RunContext& context) {
    return std::pair(context.scratch().data() + 4096, context.scratch().data() + 4096 + bytes);
  };
  workload.server = [=](const RunContext& context) {
    auto& lines = *reinterpret_cast<Bounce*>(context.scratch().data());
    const auto [request, reply] = buffers(context);
    context.ready();
    for (std::uint32_t turn = 1; !context.stopping(); ++turn) {
      Wait::wait(lines.request.word, turn);
      if (work) work(request, reply);
      Wait::post(lines.reply.word, turn);
    }
  };
  workload.requester = [=](const RunContext& context) {
    auto& lines = *reinterpret_cast<Bounce*>(context.scratch().data());
    const auto [request, reply] = buffers(context);
    std::uint32_t turn = 0;
    timeEach(context, [&] {
      ++turn;
      if (work) work(reply, request);
      Wait::post(lines.request.word, turn);
      Wait::wait(lines.reply.word, turn);
    });
    // The server checks stopping() after its post, so it needs one more turn to end. It may also
    // have ended already.
    context.stop();
    Wait::post(lines.request.word, ++turn);
  };
  return workload;
}

// Slots of one line each, published by their sequence number; the consumer frees them in batches.
struct Slot {
  alignas(kLineBytes) std::atomic<std::uint64_t> sequence{0};
  std::uint64_t payload = 0;
};
struct RingHead {
  alignas(2 * kLineBytes) std::atomic<std::uint64_t> freed{0};
};

Workload ring(std::uint64_t capacity, std::uint64_t freeEvery) {
  Workload workload;
  workload.scratchBytes = 4096 + capacity * sizeof(Slot);
  const auto slotsOf = [](const RunContext& context) {
    return reinterpret_cast<Slot*>(context.scratch().data() + 4096);
  };
  const auto headOf = [](const RunContext& context) -> RingHead& {
    return *reinterpret_cast<RingHead*>(context.scratch().data());
  };
  workload.server = [=](const RunContext& context) {
    auto* slots = slotsOf(context);
    auto& freed = headOf(context).freed;
    std::uint64_t sum = 0;
    context.ready();
    for (std::uint64_t taken = 0;;) {
      auto& slot = slots[taken & (capacity - 1)];
      // PAIR(bench-slot-filled): once the sequence is visible, the payload is.
      while (slot.sequence.load(std::memory_order_acquire) != taken + 1) cpuRelax();
      sum += slot.payload;
      asm volatile("" : : "r"(sum));
      if (++taken % freeEvery != 0) continue;
      // PAIR(bench-slot-freed): the payloads have been read.
      freed.store(taken, std::memory_order_release);
      context.consumed(taken);
    }
  };
  workload.requester = [=](const RunContext& context) {
    auto* slots = slotsOf(context);
    auto& freed = headOf(context).freed;
    std::uint64_t pushed = 0;
    std::uint64_t freedSeen = 0;
    timeOneWay(context, [&](const auto& resume) {
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
  return workload;
}

// memcpy in one process between its own buffers. It copies `spread` bytes before it uses the same
// buffer again.
Workload copyAlone(std::size_t bytes, std::size_t spread) {
  Workload workload;
  workload.requester = [=](const RunContext& context) {
    const auto pairs = std::max<std::size_t>(1, spread / bytes / 2);
    std::vector<std::byte> from(bytes * pairs, std::byte{1});
    std::vector<std::byte> to(bytes * pairs, std::byte{2});
    std::size_t at = 0;
    timeEach(context, [&] {
      std::memcpy(to.data() + at * bytes, from.data() + at * bytes, bytes);
      asm volatile("" : : "r"(to.data()) : "memory");
      at = at + 1 < pairs ? at + 1 : 0;
    });
  };
  return workload;
}

// The floor of connecting: a link consists of at least one segment.
Workload makeSegment() {
  Workload workload;
  workload.requester = [](const RunContext& context) {
    const std::string name = "/mpf-bench-floor-" + std::to_string(::getpid());
    timeEach(context, [&] {
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
  return workload;
}

Measurement floor(const std::string& question, const std::string& name, Mode mode,
                  std::size_t bytes, const Workload& workload) {
  Measurement row;
  row.question = question;
  row.name = name;
  row.mode = mode;
  row.bytes = bytes;
  row.run = [workload](const Stage& stage) { return stage.run(workload); };
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
