// SPDX-License-Identifier: MIT
// OptionFields: the value of an option that says several things, "a-Ip330Scan,0,15,100,20": they
// are taken one after the other.
//
//   addWords(app, "--scan", "NAME[,FIRST[,QUEUE]]", "A server of means", [this](Words& words) {
//     auto name = words.word("name");
//     const int first = words.number("first channel", 0);
//     scans.push_back({name, first, words.queueSize()});
//   });
//
// A word that is left out, or empty, has its default where there is one. All complaints are
// CLI::ValidationErrors that name the option, its value and what is wrong with it.
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
  static constexpr int kQueueSizeAsBefore = 20;

  OptionFields(std::string option, const std::string& text);

  // The next one. `what` it is, for complaints.
  [[nodiscard]] std::string word(const char* what);
  [[nodiscard]] std::string word(const char* what, std::string_view otherwise);
  [[nodiscard]] int number(const char* what);
  [[nodiscard]] int number(const char* what, int otherwise);
  [[nodiscard]] char letter(const char* what, char otherwise);
  // As many requests of one client may wait.
  [[nodiscard]] int queueSize();
  // Complains about what has not been taken.
  void end() const;
  [[noreturn]] void complain(const std::string& why) const;

 private:
  [[nodiscard]] bool hasNext() const { return next_ < words_.size() && !words_[next_].empty(); }
  std::string option_;
  std::string text_;
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

// Adds an option that may be given more than once; `take` takes the words of one. `app` must not
// outlive what `take` refers to.
//   form  "NAME[,FIRST[,LAST]]", for --help
CLI::Option* addWords(CLI::App& app, const std::string& option, const char* form, const char* help,
                      const std::function<void(OptionFields&)>& take);

}  // namespace mpf
