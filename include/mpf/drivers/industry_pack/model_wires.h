// SPDX-License-Identifier: MIT
// ModelWires: wires between device models of different processes: named voltages in a file that all
// of the processes map.
//
//   DAC model ── "dac.0" = 2.5 V ──► file ──► ADC model
//   DIO model ── "dio.5" = 5 V ────► file ──► DIO model
//
//   ModelWires wires("/tmp/wires");
//   auto output = wires.wire("dac.0");
//   output.set(2.5);
//
//   | magic, version, capacity, changes | wire 0: state, name, value | wire 1 | ... |
//
// Numbers in the file are in the byte order of the host.
//
// The first process creates the file. It stays, with the last values, when all processes have
// ended; remove it to start with all wires at 0.
//
// Threads  any, in any process: values are atomic, and the last one that was set counts.
// Crash    a process that is killed while it creates the file or adds a wire leaves nothing
//          incomplete in use; the next process completes it.
// Trust    processes that may write the file are trusted not to truncate it while it is used. A
//          file with other contents is refused at the start.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <mpf/file_descriptor.h>

namespace mpf {

struct ModelWiresFile;  // the layout of the file

// One wire. Valid as long as its ModelWires.
class ModelWire {
 public:
  // The value, in the unit on which the models at the wire agree: V for analog signals, 0 and 1 for
  // digital ones. Any thread.
  [[nodiscard]] double get() const noexcept {
    return std::bit_cast<double>(value_->load(std::memory_order_relaxed));
  }
  void set(double value) const noexcept;

 private:
  friend class ModelWires;
  ModelWire(ModelWiresFile& file, std::atomic<std::uint64_t>& value)
      : file_(&file), value_(&value) {}
  ModelWiresFile* file_;
  std::atomic<std::uint64_t>* value_;
};

class ModelWires {
 public:
  // Maps the file, and creates it if needed.
  //   throws  std::system_error; std::runtime_error when the file has other contents, is damaged or
  //           has another version
  explicit ModelWires(std::string path);
  ~ModelWires();
  ModelWires(const ModelWires&) = delete;
  ModelWires& operator=(const ModelWires&) = delete;

  // Returns the wire with this name; a new wire has the value 0.
  //   name    1 to 43 printable characters without spaces
  //   throws  std::invalid_argument for an invalid name, std::runtime_error above 1024 wires
  [[nodiscard]] ModelWire wire(std::string_view name);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  friend class ModelWireWatcher;
  void map();
  void prepare();

  std::string path_;
  FileDescriptor fd_;
  std::mutex mutex_;  // between threads; flock() works only between processes
  ModelWiresFile* file_ = nullptr;
};

// Calls a function on a thread of its own after a wire has changed, in any process; one call may
// report several changes.
class ModelWireWatcher {
 public:
  //   wires    outlives this object
  //   changed  must not throw, and must not destroy this object
  //   throws   std::system_error when no thread can be started
  ModelWireWatcher(ModelWires& wires, std::function<void()> changed);
  // The function does not run after return.
  ~ModelWireWatcher();
  ModelWireWatcher(const ModelWireWatcher&) = delete;
  ModelWireWatcher& operator=(const ModelWireWatcher&) = delete;

 private:
  ModelWiresFile& file_;
  std::jthread thread_;
};

}  // namespace mpf
