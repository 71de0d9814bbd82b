// SPDX-License-Identifier: MIT
// Ioc: an IOC in this process, on the backplane of MPF_BACKPLANE, without Channel Access.
#pragma once

#include <alarm.h>
#include <array>
#include <dbAccess.h>
#include <dbLock.h>
#include <dbUnitTest.h>
#include <epicsUnitTest.h>
#include <errlog.h>
#include <gtest/gtest.h>
#include <iocshRegisterCommon.h>
#include <string>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace mpf::test {

class Ioc {
 public:
  //   database  text of a .db file
  //   macros    "P=lab:,N=1"
  explicit Ioc(const std::string& database, const std::string& macros = "") {
    testPlan(0);
    eltc(0);  // errors are expected; not on the terminal
    testdbPrepare();
    testdbReadDatabase("base.dbd", MPF_TEST_DBD, nullptr);
    testdbReadDatabase("mpf.dbd", MPF_TEST_DBD, nullptr);
    EXPECT_EQ(registerAllRecordDeviceDrivers(pdbbase), 0);
    static_cast<void>(folder_.write("test.db", database));
    testdbReadDatabase("test.db", folder_.path().c_str(), macros.c_str());
    testIocInitOk();
  }
  ~Ioc() {
    testIocShutdownOk();
    testdbCleanup();
  }
  Ioc(const Ioc&) = delete;
  Ioc& operator=(const Ioc&) = delete;

  // A field as a string, such as get("x.SEVR").
  static std::string get(const std::string& field) {
    DBADDR address;
    if (dbNameToAddr(field.c_str(), &address) != 0) return "no field " + field;
    std::array<char, MAX_STRING_SIZE> text{};
    long count = 1;
    if (dbGetField(&address, DBR_STRING, text.data(), nullptr, &count, nullptr) != 0)
      return "cannot read " + field;
    return text.data();
  }
  static long put(const std::string& field, const std::string& value) {
    DBADDR address;
    if (const auto status = dbNameToAddr(field.c_str(), &address); status != 0) return status;
    std::array<char, MAX_STRING_SIZE> text{};
    value.copy(text.data(), text.size() - 1);
    return dbPutField(&address, DBR_STRING, text.data(), 1);
  }
  // When the record processed, or got its alarm.
  static epicsTimeStamp timeOf(const std::string& record) {
    DBADDR address;
    EXPECT_EQ(dbNameToAddr(record.c_str(), &address), 0);
    dbScanLock(address.precord);
    const auto time = address.precord->time;
    dbScanUnlock(address.precord);
    return time;
  }
  // Waits until the field has the value.
  static void waitFor(const std::string& field, const std::string& value) {
    while (get(field) != value) std::this_thread::yield();
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace mpf::test
