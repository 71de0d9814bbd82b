// SPDX-License-Identifier: MIT
// IocFile: the commands of a startup file that belong to an EPICS IOC, as a file for mpf-ioc, in
// the language of iocsh.
//
//   # st.cmd:50: dbLoadRecords("ipApp/Db/SR570.db","P=13IDD:,C=0", ip)
//   dbLoadRecords("/site/ip/ipApp/Db/SR570.db", "P=13IDD:,C=0")
//
// Threads  one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mpf::startup {

class IocFile {
 public:
  //   source  the line that it comes from
  void add(const std::string& command, const std::vector<std::string>& arguments,
           const std::string& source);
  // Whether the file has databases or starts an IOC.
  [[nodiscard]] bool isNeeded() const noexcept { return isNeeded_; }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  bool isNeeded_ = false;
};

// What is wrong with an argument that iocsh cannot read, in quotes or without; empty: nothing.
[[nodiscard]] std::string problemOfArgument(std::string_view text);

// An argument in quotes. It has no problem.
[[nodiscard]] std::string iocshQuoted(std::string_view text);

}  // namespace mpf::startup
