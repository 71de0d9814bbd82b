// SPDX-License-Identifier: MIT
// OptionFields: the value of an option with several fields, "a-Ip330Scan,0,15,100,20", which are
// read one after the other.
//
//   addFields(app, "--scan", "NAME[,FIRST[,QUEUE]]", "Adds a scan server", [this](auto& fields) {
//     auto name = fields.word("name");
//     const int first = fields.number("first channel", 0);
//     scans.push_back({name, first, fields.queueSize()});
//   });
//
// A field that is missing or empty has its default, if it has one. Errors are CLI::ValidationErrors
// that name the option, its value and the problem.
//
// Threads  the program's main thread, at start.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
class Option;
}  // namespace CLI

namespace mpf {

class OptionFields {
 public:
  static constexpr int kDefaultQueueSize = 20;

  OptionFields(std::string option, const std::string& text);

  // The next field. Each function throws when the field is missing without a default, or invalid.
  //   what  the meaning of the field, for the error message
  [[nodiscard]] std::string word(const char* what);
  [[nodiscard]] std::string word(const char* what, std::string_view otherwise);
  [[nodiscard]] int number(const char* what);
  [[nodiscard]] int number(const char* what, int otherwise);
  [[nodiscard]] char letter(const char* what, char otherwise);
  // Requests of one client that may wait.
  [[nodiscard]] int queueSize();
  // Throws when fields are left.
  void end() const;
  // Throws CLI::ValidationError.
  [[noreturn]] void complain(const std::string& why) const;

 private:
  [[nodiscard]] bool hasNext() const { return next_ < fields_.size() && !fields_[next_].empty(); }
  std::string option_;
  std::string text_;
  std::vector<std::string> fields_;
  std::size_t next_ = 0;
};

// Adds an option that may be given more than once; `take` reads the fields of each. `app` must not
// outlive what `take` refers to.
//   form  "NAME[,FIRST[,LAST]]", for --help
CLI::Option* addFields(CLI::App& app, const std::string& option, const char* form, const char* help,
                       const std::function<void(OptionFields&)>& take);

}  // namespace mpf
