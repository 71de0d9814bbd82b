// SPDX-License-Identifier: MIT
// BenchIoc: an IOC in the process of the requester, or a client of Channel Access in the process of
// the server. It is a module that these processes load: libraries of EPICS must not be loaded in
// the runner, which forks.
//
// Threads  one thread.
// Owner    lives until the process ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mpf::bench {

class BenchIoc {
 public:
  // Starts the IOC.
  //   backplane  of the records' servers
  //   database   text of a .db file
  //   throws     std::runtime_error if the database cannot be loaded or the IOC cannot start
  virtual void start(const std::string& backplane, const std::string& database) = 0;
  // Writes a field, such as "a0.PROC", and processes the record where EPICS does so.
  virtual void put(const std::string& field, const std::string& value) = 0;
  [[nodiscard]] virtual std::string get(const std::string& field) = 0;
  // The number of a record for isInvalid().
  [[nodiscard]] virtual std::size_t find(const std::string& record) = 0;
  [[nodiscard]] virtual bool isInvalid(std::size_t record) const = 0;
  virtual void process(const std::string& record, int times) = 0;

  // Monitors a record of an IOC as a client of Channel Access.
  virtual void monitor(const std::string& record) = 0;
  // Waits until the monitor has the value.
  virtual void waitForMonitor(std::int32_t value) = 0;

 protected:
  ~BenchIoc() = default;
};

// Loads the module.
//   throws  std::runtime_error if it is missing
[[nodiscard]] BenchIoc& loadBenchIoc();
// Why rows about records are left out; empty if the module is there.
[[nodiscard]] std::string whyNoBenchIoc();

// The module's only symbol.
inline constexpr const char* kBenchIocFactory = "mpfBenchIoc";
using BenchIocFactory = BenchIoc& (*)();

// Processes the record until it is idle without an alarm: its server is connected then.
void waitUntilValid(BenchIoc& ioc, const std::string& record);

}  // namespace mpf::bench
