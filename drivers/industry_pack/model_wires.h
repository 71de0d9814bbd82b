// SPDX-License-Identifier: MIT
// ModelWires: what models in different processes share in place of wires: numbers with names, in a file that all of them map.
//
//   DAC model ── "dac.0" = 2.5 V ──► file ──► ADC model
//   DIO model ── "dio.5" = 5 V ────► file ──► the same or another DIO model
//
//   ModelWires wires("/tmp/wires");
//   auto output = wires.wire("dac.0");
//   output.set(2.5);
//
//   | magic, version, capacity, changes | wire 0: state, name, value | wire 1 | ... |     little- or big-endian as the host is
//
// The first one makes the file; it stays when all are gone, with the last values, as charge on a wire would not: who wants none removes it.
//
// Threads  any, in any process: values are atomic, the last one set counts.
// Crash    killed while it makes the file or adds a wire, a process has made or added nothing; the next one goes on.
// Trust    whoever may write the file is trusted not to cut it while it is used; what is no such file at the start is an error.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <mpf/base/file_descriptor.h>

namespace mpf {

struct ModelWiresFile;  // the layout

// One of them. Valid as long as the ModelWires that it is from.
class ModelWire {
 public:
  [[nodiscard]] double get() const noexcept { return std::bit_cast<double>(value_->load(std::memory_order_relaxed)); }
  void set(double value) const noexcept;

 private:
  friend class ModelWires;
  ModelWire(ModelWiresFile& file, std::atomic<std::uint64_t>& value) : file_(&file), value_(&value) {}
  ModelWiresFile* file_;
  std::atomic<std::uint64_t>* value_;
};

class ModelWires {
 public:
  //   throws  std::system_error; std::runtime_error when the file is another's, damaged or of another version
  explicit ModelWires(std::string path);
  ~ModelWires();
  ModelWires(const ModelWires&) = delete;
  ModelWires& operator=(const ModelWires&) = delete;

  // The wire of that name; a new one carries 0.
  //   name    1 to 43 printable characters without spaces
  //   throws  std::invalid_argument, std::runtime_error when there is no room for one more
  [[nodiscard]] ModelWire wire(std::string_view name);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  friend class ModelWireWatcher;
  void map();
  void prepare();

  std::string path_;
  FileDescriptor fd_;
  std::mutex mutex_;  // flock() is between processes
  ModelWiresFile* file_ = nullptr;
};

// Calls a function on a thread of its own after any wire has changed, in any process; several changes may be one call.
class ModelWireWatcher {
 public:
  // `wires` must outlive this.
  ModelWireWatcher(ModelWires& wires, std::function<void()> changed);
  // After return the function does not run any more.
  ~ModelWireWatcher();
  ModelWireWatcher(const ModelWireWatcher&) = delete;
  ModelWireWatcher& operator=(const ModelWireWatcher&) = delete;

 private:
  ModelWiresFile& file_;
  std::jthread thread_;
};

}  // namespace mpf
