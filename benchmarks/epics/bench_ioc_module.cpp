// SPDX-License-Identifier: MIT
// The module of BenchIoc.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <alarm.h>
#include <array>
#include <cstdlib>
#include <dbAccess.h>
#include <dbCommon.h>
#include <dbLock.h>
#include <errlog.h>
#include <filesystem>
#include <fmt/format.h>
#include <iocInit.h>
#include <iocshRegisterCommon.h>
#include <optional>
#include <stdexcept>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/epics/ca_monitor.h"

namespace mpf::bench {
namespace {

void check(long status, const std::string& what) {
  if (status != 0) throw std::runtime_error("cannot " + what);
}

// The folder that mpf-ioc uses, too.
std::string dbdFolder() {
  return std::filesystem::canonical("/proc/self/exe").parent_path().parent_path() / "share/mpf/dbd";
}

void loadText(const std::string& database) {
  const FileDescriptor file(checkCall(::memfd_create("bench.db", MFD_CLOEXEC), "memfd_create"));
  if (::write(file.get(), database.data(), database.size()) !=
      static_cast<ssize_t>(database.size()))
    throwSystemError(errno, "write", "the database");
  check(dbLoadRecords(fmt::format("/proc/self/fd/{}", file.get()).c_str(), nullptr),
        "load the database");
}

// Standard output belongs to the table.
void silence() {
  const FileDescriptor nothing(checkCall(::open("/dev/null", O_WRONLY | O_CLOEXEC), "open"));
  ::dup2(nothing.get(), STDOUT_FILENO);
  eltc(0);
}

DBADDR addressOf(const std::string& field) {
  DBADDR address;
  check(dbNameToAddr(field.c_str(), &address), "find the field " + field);
  return address;
}

class EpicsIoc final : public BenchIoc {
 public:
  void start(const std::string& backplane, const std::string& database) override {
    silence();
    ::setenv("MPF_BACKPLANE", backplane.c_str(), 1);
    iocshRegisterCommon();
    for (const char* name : {"base.dbd", "mpf.dbd"})
      check(dbLoadDatabase(name, dbdFolder().c_str(), nullptr),
            fmt::format("load {}/{}", dbdFolder(), name));
    check(registerAllRecordDeviceDrivers(pdbbase), "register the record types");
    loadText(database);
    check(iocInit(), "start the IOC");
  }

  void put(const std::string& field, const std::string& value) override {
    auto address = addressOf(field);
    std::array<char, MAX_STRING_SIZE> text{};
    value.copy(text.data(), text.size() - 1);
    check(dbPutField(&address, DBR_STRING, text.data(), 1), "write " + field);
  }

  std::string get(const std::string& field) override {
    auto address = addressOf(field);
    std::array<char, MAX_STRING_SIZE> text{};
    long count = 1;
    check(dbGetField(&address, DBR_STRING, text.data(), nullptr, &count, nullptr), "read " + field);
    return text.data();
  }

  std::size_t find(const std::string& record) override {
    records_.push_back(addressOf(record).precord);
    return records_.size() - 1;
  }
  // Without its lock: the caller looks again and again.
  bool isInvalid(std::size_t record) const override {
    return *static_cast<const volatile epicsEnum16*>(&records_.at(record)->sevr) == INVALID_ALARM;
  }

  void process(const std::string& record, int times) override {
    auto* common = addressOf(record).precord;
    for (int time = 0; time < times; ++time) {
      dbScanLock(common);
      dbProcess(common);
      dbScanUnlock(common);
    }
  }

  void monitor(const std::string& record) override { monitor_.emplace(record); }
  void waitForMonitor(std::int32_t value) override { monitor_.value().waitFor(value); }

 private:
  std::optional<CaMonitor> monitor_;
  std::vector<const dbCommon*> records_;
};

}  // namespace
}  // namespace mpf::bench

extern "C" mpf::bench::BenchIoc& mpfBenchIoc() {
  static auto* ioc = new mpf::bench::EpicsIoc;
  return *ioc;
}
