// SPDX-License-Identifier: MIT
// Checks of shared memory: its file system, its space, its access rights, and what may remove it.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>
#include <set>
#include <sstream>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"
#include "shm/segment_name.h"
#include "tools/doctor/checks.h"

namespace mpf::tools {
namespace {

constexpr std::uint64_t kMiB = 1024 * 1024UL;
// The first user id that logind regards as a person: SYS_UID_MAX + 1 on Debian.
constexpr std::uint32_t kFirstLoginUser = 1000;

// The files of all backplanes, with their status.
std::vector<std::pair<std::filesystem::path, struct stat>> segmentsOf(const Host& host) {
  std::vector<std::pair<std::filesystem::path, struct stat>> segments;
  for (const auto& name : host.list("dev/shm")) {
    struct stat status{};
    const auto path = host.root / "dev/shm" / name;
    if (SegmentName::tryParse(name) && ::lstat(path.c_str(), &status) == 0)
      segments.emplace_back(path, status);
  }
  return segments;
}

std::set<std::uint32_t> numbersOf(const std::optional<std::string>& text) {
  std::set<std::uint32_t> numbers;
  std::istringstream words(text.value_or(""));
  for (std::uint32_t number = 0; words >> number;) numbers.insert(number);
  return numbers;
}

// The effective user of this process.
std::optional<std::uint32_t> userOf(const Host& host) {
  std::istringstream words(host.ofProcess("Uid").value_or(""));
  std::uint32_t real = 0;
  std::uint32_t effective = 0;
  if (!(words >> real >> effective)) return std::nullopt;
  return effective;
}

// The value of a key in the configuration of logind: the last assignment in the main file and then
// in the drop-in files, in the order in which logind reads them; `otherwise` without an assignment.
std::string logindSetting(const Host& host, const std::string& key, const std::string& otherwise) {
  // By file name: a file in /etc hides the file of the same name in /usr.
  std::map<std::string, std::string> dropIns;
  for (const std::string folder : {"usr/lib/systemd", "run/systemd", "etc/systemd"}) {
    for (const auto& name : host.list(folder + "/logind.conf.d")) {
      if (name.ends_with(".conf")) dropIns[name] = fmt::format("{}/logind.conf.d/{}", folder, name);
    }
  }
  std::vector<std::string> files{"usr/lib/systemd/logind.conf", "etc/systemd/logind.conf"};
  for (const auto& [name, path] : dropIns) files.push_back(path);
  auto value = otherwise;
  for (const auto& file : files) {
    for (auto line : host.tryReadLines(file)) {
      std::erase(line, ' ');
      if (line.starts_with(key + "=")) value = line.substr(key.size() + 1);
    }
  }
  return value;
}

bool isNo(const std::string& value) {
  return value == "no" || value == "false" || value == "off" || value == "0" || value == "n";
}

}  // namespace

Finding checkMount(const Host& host) {
  constexpr const char* kName = "mount of /dev/shm";
  const auto mount = host.mountAt("/dev/shm");
  if (!host.tryRead("proc/self/mounts"))
    return {kName, Health::unknown, "/proc/self/mounts cannot be read", {}};
  if (!mount) {
    return {kName, Health::warning,
            "not a file system of its own: segments are on a disk, or in the memory of another "
            "file system",
            "mount -t tmpfs tmpfs /dev/shm"};
  }
  if (mount->options.contains("ro"))
    return {kName, Health::problem, "mounted read-only: no server can start",
            "mount -o remount,rw /dev/shm"};
  if (mount->type != "tmpfs") {
    return {
        kName, Health::warning,
        fmt::format("{}, not tmpfs: segments may be slow, or larger than the memory", mount->type),
        "mount -t tmpfs tmpfs /dev/shm"};
  }
  return {kName, Health::ok, "tmpfs, writable", {}};
}

Finding checkSpace(const Host& host) {
  constexpr const char* kName = "space in /dev/shm";
  constexpr std::uint64_t kLittle = 16 * kMiB;
  constexpr std::uint64_t kFewFiles = 1000;
  constexpr std::uint64_t kFilesOfALink = 10;
  const auto space = host.sharedMemory();
  if (!space) return {kName, Health::unknown, "its size cannot be read", {}};
  const auto seen =
      fmt::format("{} of {} free", bytesText(space->freeBytes), bytesText(space->totalBytes));
  const auto files = fmt::format("{} of {} inodes free, and each window, link and pool is a file",
                                 space->freeFiles, space->totalFiles);
  const std::string moreFiles = "mount -o remount,nr_inodes=1M /dev/shm";
  const std::string more = "mount -o remount,size=1G /dev/shm; containers: --shm-size=1g";
  if (space->freeFiles < kFilesOfALink) {
    return {kName, Health::problem, files + ": links and servers are refused",
            "mpf clean; remove unused files of other programs; " + moreFiles};
  }
  if (space->freeBytes < kMiB) {
    return {kName, Health::problem, seen + ": links and servers are refused",
            "mpf clean; remove unused files of other programs; " + more};
  }
  if (space->freeFiles < kFewFiles) {
    return {kName, Health::warning, files, "mpf clean; " + moreFiles};
  }
  if (space->freeBytes < kLittle)
    return {kName, Health::warning, seen + ": large messages will be refused",
            "mpf clean; " + more};
  if (space->totalBytes <= 64 * kMiB) {
    return {kName, Health::warning,
            seen + ": the small default of containers; large messages and many clients need more",
            more};
  }
  return {kName, Health::ok, seen, {}};
}

Finding checkRights(const Host& host) {
  constexpr const char* kName = "rights of /dev/shm";
  struct stat status{};
  if (::stat((host.root / "dev/shm").c_str(), &status) != 0) {
    return {kName, Health::problem, "/dev/shm does not exist",
            "mkdir -m 1777 /dev/shm; mount -t tmpfs tmpfs /dev/shm"};
  }
  const auto seen = fmt::format("mode {:04o}", status.st_mode & 07777u);
  const std::string remedy = "chmod 1777 /dev/shm";
  if ((status.st_mode & 0007u) != 0007u)
    return {kName, Health::problem, seen + ": not every user may create segments", remedy};
  if ((status.st_mode & S_ISVTX) == 0)
    return {kName, Health::warning, seen + ": any user may remove the segments of any other",
            remedy};
  return {kName, Health::ok, seen, {}};
}

Finding checkSegments(const Host& host) {
  constexpr const char* kName = "rights of segments";
  const auto self = userOf(host);
  if (!self) return {kName, Health::unknown, "/proc/self/status cannot be read", {}};
  auto groups = numbersOf(host.ofProcess("Groups"));
  groups.merge(numbersOf(host.ofProcess("Gid")));
  const auto segments = segmentsOf(host);
  std::set<std::uint32_t> owners;
  std::size_t closed = 0;
  for (const auto& [path, status] : segments) {
    const auto needed = status.st_uid == *self           ? 0400u
                        : groups.contains(status.st_gid) ? 0040u
                                                         : 0004u;
    if (*self == 0 || (status.st_mode & needed) != 0) continue;
    owners.insert(status.st_uid);
    ++closed;
  }
  if (closed == 0)
    return {
        kName, Health::ok, fmt::format("{} files, this user may read all", segments.size()), {}};
  return {
      kName, Health::warning,
      fmt::format("this user may not read {} of {} files; user {} owns one of them", closed,
                  segments.size(), *owners.begin()),
      "start these servers with --group GROUP --mode 0660, or run mpf as their user or as root"};
}

Finding checkNamespaces(const Host& host) {
  constexpr const char* kName = "pid namespaces";
  struct stat own{};
  if (::stat((host.root / "proc/self/ns/pid").c_str(), &own) != 0)
    return {kName, Health::unknown, "/proc/self/ns/pid cannot be read", {}};
  std::size_t windows = 0;
  std::size_t foreign = 0;
  for (const auto& [path, status] : segmentsOf(host)) {
    const auto parsed = SegmentName::tryParse(path.filename().string());
    const bool isWindow = parsed && (parsed->kind == NameKind::serverWindow ||
                                     parsed->kind == NameKind::clientWindow);
    if (!isWindow || !S_ISREG(status.st_mode)) continue;
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    layout::SegmentHeader header{};
    if (!file ||
        ::pread(file.get(), &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header))
      continue;
    ++windows;
    if (header.pidNamespace != own.st_ino) ++foreign;
  }
  if (foreign == 0)
    return {kName,
            Health::ok,
            fmt::format("{} windows, all of processes of this namespace", windows),
            {}};
  return {
      kName, Health::warning,
      fmt::format("{} of {} windows belong to processes of another namespace: their death is "
                  "detected up to 0.1 s later, and reports cannot show whether they are stopped",
                  foreign, windows),
      "run all in one pid namespace; containers: --pid=host, or --pid=container:NAME"};
}

Finding checkRemoveIpc(const Host& host) {
  constexpr const char* kName = "RemoveIPC of logind";
  struct stat systemd{};
  if (::stat((host.root / "run/systemd/system").c_str(), &systemd) != 0)
    return {kName, Health::ok, "systemd is not running here", {}};
  const auto self = userOf(host);
  if (!self) return {kName, Health::unknown, "/proc/self/status cannot be read", {}};
  auto users = std::set{*self};
  for (const auto& [path, status] : segmentsOf(host)) users.insert(status.st_uid);
  const auto value = logindSetting(host, "RemoveIPC", "yes");
  const auto login = users.lower_bound(kFirstLoginUser);
  if (isNo(value)) return {kName, Health::ok, "RemoveIPC=" + value, {}};
  if (login == users.end())
    return {kName,
            Health::ok,
            fmt::format("RemoveIPC={}, which excepts users below {}", value, kFirstLoginUser),
            {}};
  return {
      kName, Health::problem,
      fmt::format(
          "RemoveIPC={}: when user {} logs out, logind removes the segments of running programs",
          value, *login),
      fmt::format("RemoveIPC=no under [Login] in /etc/systemd/logind.conf.d/mpf.conf, then "
                  "systemctl restart systemd-logind; or run servers as a system user; or loginctl "
                  "enable-linger {}",
                  *login)};
}

}  // namespace mpf::tools
