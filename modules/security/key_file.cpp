#include "modules/security/key_file.hpp"

#include <sodium.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileSize = 1U << 20U;

InputFile open_key_file(const fs::path& file) try {
  return open_input_file(file, kMaxFileSize);
} catch (const InputFileError& error) {
  throw std::runtime_error(std::string(error.what()) + "; kimera_multi_keys makes it (--help)");
}

// Checks the status of the file that was read, because the name may refer to another file now.
void check_access(const fs::path& file, const fs::file_status& status) {
  const fs::perms mode = status.permissions();
  if ((mode & (fs::perms::group_all | fs::perms::others_all)) == fs::perms::none) return;
  char text[8];
  std::snprintf(text, sizeof text, "%04o", static_cast<unsigned>(mode & fs::perms::mask));
  throw std::runtime_error(file.string() + ": has mode " + text +
                           ", so other users can read a secret; if nobody has read it, "
                           "run: chmod 600 " +
                           file.string() + "; otherwise revoke its certificate");
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

}  // namespace

KeyFile KeyFile::read(const fs::path& file, std::string_view format, KeyFileAccess access) {
  auto [text, status] = open_key_file(file);
  if (access == KeyFileAccess::kOwner && fs::is_regular_file(status)) check_access(file, status);

  KeyFile result;
  result.file_ = file;
  std::string_view rest = text;
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(rest.size(), end + 1));
    if (line.empty() || line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos)
      throw std::runtime_error(file.string() + ", line " + std::to_string(number) +
                               ": has no \"name: value\"");
    result.lines_.push_back({number, std::string(trimmed(line.substr(0, colon))),
                             std::string(trimmed(line.substr(colon + 1)))});
  }
  sodium_memzero(text.data(), text.size());
  const Line& first = result.next("format");
  if (first.value != format)
    result.refuse(first, "is not \"" + std::string(format) +
                             "\": another file, or of another version of kimera_multi_keys");
  return result;
}

const KeyFile::Line& KeyFile::next(std::string_view name) {
  if (at_ == lines_.size())
    throw std::runtime_error(file_.string() + ": ends without \"" + std::string(name) +
                             "\"; copy it again");
  const Line& line = lines_[at_++];
  if (line.name != name)
    throw std::runtime_error(file_.string() + ", line " + std::to_string(line.number) + ": has \"" +
                             line.name + "\" instead of \"" + std::string(name) +
                             "\"; copy the file again");
  return line;
}

bool KeyFile::next_is(std::string_view name) const {
  return at_ < lines_.size() && lines_[at_].name == name;
}

void KeyFile::finish() const {
  if (at_ < lines_.size())
    throw std::runtime_error(file_.string() + ", line " + std::to_string(lines_[at_].number) +
                             ": \"" + lines_[at_].name + "\" is not expected; copy the file again");
}

void KeyFile::refuse(const Line& line, const std::string& why) const {
  throw std::runtime_error(file_.string() + ", line " + std::to_string(line.number) + ": " +
                           line.name + " \"" + line.value + "\" " + why);
}

void KeyFile::read_hex(const Line& line, std::string_view text, std::uint8_t* octets,
                       std::size_t size) const {
  std::size_t read = 0;
  const char* end = nullptr;
  if (sodium_hex2bin(octets, size, text.data(), text.size(), nullptr, &read, &end) == 0 &&
      read == size && end == text.data() + text.size())
    return;
  throw std::runtime_error(file_.string() + ", line " + std::to_string(line.number) + ": " +
                           line.name + " does not have " + std::to_string(2 * size) +
                           " hexadecimal digits; copy the file again");
}

Secret<32> KeyFile::secret(const Line& line) const {
  Secret<32> value;
  read_hex(line, line.value, value.data(), value.size());
  return value;
}

std::uint64_t KeyFile::number(const Line& line, std::uint64_t max) const {
  std::uint64_t value = 0;
  const char* const end = line.value.data() + line.value.size();
  const auto [stop, error] = std::from_chars(line.value.data(), end, value);
  if (error != std::errc() || stop != end || value > max)
    refuse(line, "is not a number from 0 to " + std::to_string(max));
  return value;
}

std::int64_t KeyFile::time_s(const Line& line) const {
  int year = 0;
  unsigned month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::sscanf(line.value.c_str(), "%d-%u-%uT%u:%u:%uZ", &year, &month, &day, &hour, &minute,
              &second);
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  const std::int64_t time =
      date.ok() ? std::chrono::sys_seconds(std::chrono::sys_days(date)).time_since_epoch().count() +
                      3600 * std::int64_t{hour} + 60 * std::int64_t{minute} + second
                : 0;
  if (time_text(time) != line.value) refuse(line, "is not a time like 2026-11-21T12:44:29Z");
  return time;
}

void write_key_file(const fs::path& file, const std::string& text, KeyFileAccess access) {
  const unsigned mode = access == KeyFileAccess::kOwner ? 0600 : 0644;
  write_file(file, text, {.mode = mode, .through_links = false, .durable = true});
}

std::string to_hex(OctetView octets) {
  std::string text(2 * octets.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), octets.data(), octets.size());
  text.pop_back();  // the zero that ends a C string
  return text;
}

std::string time_text(std::int64_t time_s) {
  const std::chrono::sys_seconds time{std::chrono::seconds(time_s)};
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()));
  return text;
}

}  // namespace km
