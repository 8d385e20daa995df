#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/journal/journal_entry.hpp"

namespace km {

/// Sizes of the intact part of a journal and of its incomplete end, as found by read_journal().
struct JournalExtent {
  std::uintmax_t whole_bytes = 0;  ///< New entries continue here.
  std::uintmax_t cut_bytes = 0;    ///< Size of the incomplete end.
  std::size_t entries = 0;
  std::uint64_t check_sum = 0;  ///< Check sum after the last intact entry.
};

/// Position of an entry in a journal.
struct JournalPlace {
  std::uint64_t offset = 0;
  std::uint32_t bytes = 0;
};

/// Calls `take` for every intact entry in order. Throws InputFileError if the file cannot be read
/// or is no journal; a file shorter than its first eight bytes is an empty journal.
[[nodiscard]] JournalExtent read_journal(
    const std::filesystem::path& file, const std::function<void(JournalEntry, JournalPlace)>& take);

/// The entry at `place`. Throws InputFileError if no entry can be read there.
[[nodiscard]] JournalEntry read_journal_entry(const std::filesystem::path& file,
                                              const JournalPlace& place);

/// A journal is a file that only grows: eight bytes that name the format, then entries. Each entry
/// consists of its length (u32), its bytes, and a check sum (u64, FNV-1a) over them and all
/// earlier entries.
/// If a process is killed or the machine loses power, an incomplete last entry fails the check. Not
/// thread-safe.
class JournalFile {
 public:
  /// Maximum size of the entries that wait while the disk is full [bytes].
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{64} << 20U;

  /// Begins a new journal in place of an existing one. Nothing is written before sync().
  explicit JournalFile(std::filesystem::path file);
  /// Continues a journal that was read. The first sync() cuts off its incomplete end.
  JournalFile(std::filesystem::path file, const JournalExtent& read);

  /// Stores an entry for the next sync() and returns its place. A journal has no gaps: if an entry
  /// does not fit, it and all later ones are dropped, and the result is nullopt.
  std::optional<JournalPlace> add(const JournalEntry& entry);

  /// Writes all added entries to the disk, so that they survive a power failure, and closes the
  /// file, so that the disk can be unmounted. Throws std::system_error with one line that names the
  /// file and the reason; entries that are not written wait for the next call.
  void sync();

  /// False after an entry has been dropped.
  [[nodiscard]] bool is_whole() const { return !full_; }

 private:
  const std::filesystem::path file_;
  std::optional<std::uintmax_t> keep_bytes_;  // size of the intact part, until the rest is cut off
  std::uint64_t check_sum_;
  std::uint64_t end_bytes_;  // size of the file after all waiting entries are written
  std::string waiting_;
  bool full_ = false;
};

}  // namespace km
