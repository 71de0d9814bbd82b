// SPDX-License-Identifier: MIT
// LibGpib: the library of Linux GPIB, loaded while the program runs. The constants are those of
// gpib/ib.h, which are part of its binary interface.
//
// Threads  any; each thread has its own status.
// Source   Linux GPIB documentation: "Linux-GPIB Reference", <gpib/ib.h>.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace mpf {

struct LibGpib {
  // Bits of the status that each function returns.
  static constexpr int kError = 1 << 15;
  static constexpr int kTimeout = 1 << 14;
  static constexpr int kEnd = 1 << 13;
  // Numbers of errors.
  enum class Error : std::uint8_t {
    systemCall = 0,  // EDVR; count() is the error number of the system
    notController = 1,  // ECIC
    noListener = 2,  // ENOL
    notAddressed = 3,  // EADR
    notSystemController = 5,  // ESAC
    aborted = 6,  // EABO: a timeout, too
    noBoard = 7,  // ENEB
  };
  static constexpr int kOwnPrimaryAddress = 1;  // IbaPAD, for ask
  static constexpr int kStopAtByte = 0x400 | 0x1000;  // REOS | BIN, for setEndOfString
  static constexpr short kKnowsServiceRequest = 0x20;  // ValidSRQ, of lines
  static constexpr short kServiceRequest = 0x2000;  // BusSRQ, of lines

  // Loads the library.
  //   throws  std::runtime_error when it is absent or lacks a function
  explicit LibGpib(const std::string& library);

  // The functions of the library; `board` is its number.
  int (*ask)(int board, int option, int* value) = nullptr;
  int (*command)(int board, const void* bytes, long count) = nullptr;
  int (*write)(int board, const void* bytes, long count) = nullptr;
  int (*read)(int board, void* bytes, long count) = nullptr;
  int (*interfaceClear)(int board) = nullptr;
  int (*remoteEnable)(int board, int on) = nullptr;
  int (*lines)(int board, short* state) = nullptr;
  int (*setTimeout)(int board, int code) = nullptr;
  int (*setEndOfString)(int board, int mode) = nullptr;
  int (*setEnd)(int board, int on) = nullptr;
  // Of the last call of this thread.
  int (*error)() = nullptr;
  long (*count)() = nullptr;

 private:
  struct Close {
    void operator()(void* handle) const noexcept;
  };
  std::unique_ptr<void, Close> handle_;
};

}  // namespace mpf
