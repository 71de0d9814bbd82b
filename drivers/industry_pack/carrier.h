// SPDX-License-Identifier: MIT
// IndustryPackCarrier: a board with sites for Industry Pack modules; IndustryPackSite: one of them (manual, "IndustryPackCarrier").
//
//   IndustryPackCarriers carriers;                                 // main() owns it
//   carriers.add("ipac", createCarrier("tpci200", "0000:03:00.0"));
//   auto& site = carriers.site("ipac", "IP_a");
//
// Threads  carriers are added before they are used; afterwards any thread.
// Crash    a carrier leaves interrupts of its own sites disabled when it is destroyed; after a kill the next opening does it.
// Trust    the rights of the files under /sys and /dev say who may; a refused one is an error that names the file and the right.
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

  [[nodiscard]] virtual Registers& id() = 0;
  [[nodiscard]] virtual Registers& io() = 0;
  // Of size 0 where the carrier gives this site none.
  [[nodiscard]] virtual Registers& memory() = 0;
  // IntReq0*, IntReq1*.
  //   throws  std::out_of_range unless number is 0 or 1
  [[nodiscard]] virtual Interrupt& interrupt(int number) = 0;
};

class IndustryPackCarrier {
 public:
  IndustryPackCarrier() = default;
  IndustryPackCarrier(const IndustryPackCarrier&) = delete;
  IndustryPackCarrier& operator=(const IndustryPackCarrier&) = delete;
  virtual ~IndustryPackCarrier() = default;

  // The kind and where it is, for messages to people: "TPCI200 at 0000:03:00.0".
  [[nodiscard]] virtual std::string description() const = 0;
  // What whoever uses it should know, in a sentence: "its interrupts are polled: ..."; empty: nothing.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  // "IP_a", "IP_b", ...; in their order.
  [[nodiscard]] virtual std::size_t siteCount() const noexcept = 0;
  [[nodiscard]] virtual IndustryPackSite& site(std::size_t number) = 0;
};

// The name of site 0, 1, ...: "IP_a", "IP_b", ....
[[nodiscard]] std::string siteName(std::size_t number);

// Carriers by name.
class IndustryPackCarriers {
 public:
  // throws  IndustryPackError tooMany (21 there may be), std::invalid_argument when the name is empty or another's
  void add(const std::string& name, std::unique_ptr<IndustryPackCarrier> carrier);
  // throws  std::invalid_argument that names the ones that there are
  [[nodiscard]] IndustryPackCarrier& find(const std::string& name) const;
  [[nodiscard]] IndustryPackSite& site(const std::string& carrierName, const std::string& siteName) const;
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::map<std::string, std::unique_ptr<IndustryPackCarrier>> carriers_;
};

}  // namespace mpf
