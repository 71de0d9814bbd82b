// SPDX-License-Identifier: MIT
// IndustryPackCarrier: a board with sites for Industry Pack modules. IndustryPackSite: one site of
// it. IndustryPackCarriers: the carriers of a program, by name (manual, "IndustryPackCarrier").
//
//   IndustryPackCarriers carriers;                                 // owned by main()
//   carriers.add("ipac", createCarrier("tpci200", "0000:03:00.0"));
//   auto& site = carriers.site("ipac", "IP_a");
//
// Threads  add all carriers first, by one thread; afterwards any number of callers at a time.
// Crash    a carrier disables the interrupts of its sites when it is destroyed; after a kill, the
//          program that opens the site next disables them.
// Trust    access is controlled by the rights of files under /sys and /dev; an error names the file
//          and the missing right.
// Source   ANSI/VITA 4-1995; EPICS drvIpac for names and limits.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/interrupt.h>
#include <mpf/drivers/industry_pack/registers.h>

namespace mpf {

class IndustryPackSite {
 public:
  IndustryPackSite() = default;
  IndustryPackSite(const IndustryPackSite&) = delete;
  IndustryPackSite& operator=(const IndustryPackSite&) = delete;
  virtual ~IndustryPackSite() = default;

  // The ID space, the I/O space and the memory space of the site, valid as long as the carrier.
  [[nodiscard]] virtual Registers& id() = 0;
  [[nodiscard]] virtual Registers& io() = 0;
  // Has size 0 when the carrier has no memory space for this site.
  [[nodiscard]] virtual Registers& memory() = 0;
  // The interrupt request line IntReq0* or IntReq1*.
  //   throws  std::out_of_range unless number is 0 or 1
  [[nodiscard]] virtual Interrupt& interrupt(int number) = 0;
};

class IndustryPackCarrier {
 public:
  IndustryPackCarrier() = default;
  IndustryPackCarrier(const IndustryPackCarrier&) = delete;
  IndustryPackCarrier& operator=(const IndustryPackCarrier&) = delete;
  virtual ~IndustryPackCarrier() = default;

  // Kind and address, for messages to people: "TPCI200 at 0000:03:00.0".
  [[nodiscard]] virtual std::string description() const = 0;
  // A limitation that the user should know, as a sentence: "its interrupts are polled: ..."; or
  // empty.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  [[nodiscard]] virtual std::size_t siteCount() const noexcept = 0;
  // Returns site 0 ("IP_a"), 1 ("IP_b"), ...; valid as long as the carrier.
  //   throws  std::out_of_range unless number < siteCount(); std::runtime_error when another
  //           process has it
  [[nodiscard]] virtual IndustryPackSite& site(std::size_t number) = 0;
};

// The name of a site by its number: "IP_a" for 0, "IP_b" for 1, and so on.
[[nodiscard]] std::string siteName(std::size_t number);

// The carriers of a program, by name.
class IndustryPackCarriers {
 public:
  //   carrier  not null; exists as long as this object
  //   throws   IndustryPackError tooMany above 21 carriers; std::invalid_argument when the name is
  //            empty or in use
  void add(const std::string& name, std::unique_ptr<IndustryPackCarrier> carrier);
  //   throws  std::invalid_argument, which lists the existing names
  [[nodiscard]] IndustryPackCarrier& find(const std::string& name) const;
  //   throws  std::invalid_argument when there is no such carrier or site; as
  //           IndustryPackCarrier::site()
  [[nodiscard]] IndustryPackSite& site(const std::string& carrierName,
                                       const std::string& siteName) const;
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::map<std::string, std::unique_ptr<IndustryPackCarrier>> carriers_;
};

}  // namespace mpf
