// SPDX-License-Identifier: MIT
#include "crate/capsule/core_stacks.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/procfs.h>

#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <elfutils/libdwfl.h>
#include <fmt/format.h>
#include <gelf.h>
#include <memory>

#include <mpf/file_descriptor.h>

#include "base/printable.h"
#include "base/system_call.h"

namespace mpf::crate {

using Tree = nlohmann::ordered_json;

namespace {

constexpr std::size_t kMostThreads = 256;
constexpr std::size_t kMostFrames = 128;

// A core that is open.
class Core {
 public:
  explicit Core(const std::string& file)
      : file_(checkCall(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK), "open", file)) {
    ::elf_version(EV_CURRENT);
    elf_.reset(::elf_begin(file_.get(), ELF_C_READ_MMAP, nullptr));
    GElf_Ehdr header{};
    if (!elf_ || ::gelf_getehdr(elf_.get(), &header) == nullptr || header.e_type != ET_CORE)
      throw std::runtime_error(file + " is not a core");
  }
  [[nodiscard]] Elf* elf() const noexcept { return elf_.get(); }

  // The first note of a type that has at least the size of T.
  template <class T>
  [[nodiscard]] std::optional<T> note(GElf_Word type) const {
    std::size_t count = 0;
    ::elf_getphdrnum(elf_.get(), &count);
    for (std::size_t i = 0; i < count; ++i) {
      GElf_Phdr segment{};
      if (::gelf_getphdr(elf_.get(), static_cast<int>(i), &segment) == nullptr ||
          segment.p_type != PT_NOTE)
        continue;
      auto* const data = ::elf_getdata_rawchunk(
          elf_.get(), static_cast<std::int64_t>(segment.p_offset), segment.p_filesz, ELF_T_NHDR);
      if (auto found = find<T>(data, type)) return found;
    }
    return {};
  }

 private:
  template <class T>
  static std::optional<T> find(Elf_Data* data, GElf_Word type) {
    GElf_Nhdr header{};
    std::size_t name = 0;
    std::size_t content = 0;
    for (std::size_t at = 0;
         data != nullptr && (at = ::gelf_getnote(data, at, &header, &name, &content)) != 0;) {
      if (header.n_type != type || header.n_descsz < sizeof(T)) continue;
      T found;
      std::memcpy(&found, static_cast<const char*>(data->d_buf) + content, sizeof found);
      return found;
    }
    return {};
  }

  struct EndElf {
    void operator()(Elf* elf) const noexcept { ::elf_end(elf); }
  };
  FileDescriptor file_;
  std::unique_ptr<Elf, EndElf> elf_;
};

std::string readable(const char* symbol) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text(
      abi::__cxa_demangle(symbol, nullptr, nullptr, &status), &std::free);
  return printable(status == 0 && text ? text.get() : symbol);
}

// "base/step.cpp:12"; empty without debug information.
std::string sourceLine(Dwfl_Module* module, Dwarf_Addr pc) {
  auto* const line = ::dwfl_module_getsrc(module, pc);
  int number = 0;
  const auto* const file = line == nullptr
                               ? nullptr
                               : ::dwfl_lineinfo(line, nullptr, &number, nullptr, nullptr, nullptr);
  return file == nullptr ? std::string() : fmt::format("{}:{}", printable(file), number);
}

Tree describeFrame(Dwfl* dwfl, Dwarf_Addr pc) {
  Tree frame{{"address", pc}};
  auto* const module = ::dwfl_addrmodule(dwfl, pc);
  if (module == nullptr) return frame;
  if (const auto* const symbol = ::dwfl_module_addrname(module, pc))
    frame["function"] = readable(symbol);
  if (const auto line = sourceLine(module, pc); !line.empty()) frame["at"] = line;
  if (const auto* const name =
          ::dwfl_module_info(module, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr))
    frame["module"] = printable(name);
  return frame;
}

int addFrame(Dwfl_Frame* frame, void* frames) {
  auto& tree = *static_cast<Tree*>(frames);
  Dwarf_Addr pc = 0;
  bool isActivation = false;
  if (tree.size() >= kMostFrames || !::dwfl_frame_pc(frame, &pc, &isActivation))
    return DWARF_CB_ABORT;
  // The return address of a call belongs to the next line.
  tree.push_back(
      describeFrame(::dwfl_thread_dwfl(::dwfl_frame_thread(frame)), pc - (isActivation ? 0 : 1)));
  return DWARF_CB_OK;
}

int addThread(Dwfl_Thread* thread, void* threads) {
  auto& tree = *static_cast<Tree*>(threads);
  if (tree.size() >= kMostThreads) return DWARF_CB_ABORT;
  auto frames = Tree::array();
  static_cast<void>(::dwfl_thread_getframes(thread, addFrame, &frames));
  tree.push_back({{"tid", ::dwfl_thread_tid(thread)}, {"frames", std::move(frames)}});
  return DWARF_CB_OK;
}

struct EndDwfl {
  void operator()(Dwfl* dwfl) const noexcept { ::dwfl_end(dwfl); }
};

Tree threadsOf(const Core& core) {
  const auto check = [](bool isGood, const char* what) {
    if (!isGood) throw std::runtime_error(fmt::format("{}: {}", what, ::dwfl_errmsg(-1)));
  };
  ::unsetenv("DEBUGINFOD_URLS");  // no downloads while a crate waits
  Dwfl_Callbacks callbacks{};
  callbacks.find_elf = ::dwfl_build_id_find_elf;
  callbacks.find_debuginfo = ::dwfl_standard_find_debuginfo;
  const std::unique_ptr<Dwfl, EndDwfl> dwfl(::dwfl_begin(&callbacks));
  check(dwfl != nullptr, "libdwfl");
  check(::dwfl_core_file_report(dwfl.get(), core.elf(), nullptr) > 0, "mapped files");
  check(::dwfl_report_end(dwfl.get(), nullptr, nullptr) == 0, "mapped files");
  check(::dwfl_core_file_attach(dwfl.get(), core.elf()) > 0, "threads");
  auto threads = Tree::array();
  static_cast<void>(::dwfl_getthreads(dwfl.get(), addThread, &threads));
  check(!threads.empty(), "threads");
  return threads;
}

}  // namespace

std::optional<pid_t> pidOfCore(const std::string& file) try {
  const auto info = Core(file).note<elf_prpsinfo>(NT_PRPSINFO);
  return info ? std::optional<pid_t>(info->pr_pid) : std::nullopt;
} catch (const std::exception&) {
  return {};
}

Tree readCore(const std::string& file) {
  const Core core(file);
  Tree tree;
  if (const auto signal = core.note<siginfo_t>(NT_SIGINFO)) {
    tree["code"] = signal->si_code;
    if (signal->si_code > 0) tree["address"] = reinterpret_cast<std::uintptr_t>(signal->si_addr);
  }
  tree["threads"] = threadsOf(core);
  return tree;
}

}  // namespace mpf::crate
