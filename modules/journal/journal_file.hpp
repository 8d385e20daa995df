#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/stamp.hpp"
#include "modules/journal/journal_entry.hpp"

namespace km {

/// Bytes of a journal that are no entry.
struct JournalDamage {
  std::uintmax_t offset = 0;
  std::uintmax_t bytes = 0;
};

/// "run.journal: 24 bytes from byte 1200 on are damaged and left out"
[[nodiscard]] std::string to_string(const JournalDamage& damage, const std::filesystem::path& file);

/// Content of a journal, as found by read_journal().
struct JournalExtent {
  std::uintmax_t whole_bytes = 0;  ///< End of the last entry: new entries continue here.
  std::uintmax_t cut_bytes = 0;    ///< Size of the incomplete end.
  std::size_t entries = 0;
  std::vector<JournalDamage> damages = {};  ///< Parts before whole_bytes, ascending.
};

/// Position of the bytes of an entry in a journal.
struct JournalPlace {
  std::uint64_t offset = 0;
  std::uint32_t bytes = 0;
};

/// An entry that was read.
struct StoredEntry {
  JournalEntry entry;
  JournalPlace place;
  Stamp time = 0;             ///< When it was added: system clock [ns].
  bool after_damage = false;  ///< Entries before it may be missing.
};

/// Calls `take` for every readable entry in order. Entries with flipped bytes are left out and
/// stated as damage. Throws InputFileError if the file cannot be read, has other content, or has an
/// entry of another version. A file that ends before the end of its first entry is an empty
/// journal.
[[nodiscard]] JournalExtent read_journal(const std::filesystem::path& file,
                                         const std::function<void(StoredEntry)>& take);

/// The entry at `place`. Throws InputFileError if no entry can be read there.
[[nodiscard]] JournalEntry read_journal_entry(const std::filesystem::path& file,
                                              const JournalPlace& place);

/// A journal is a file that only grows. Each entry consists of a mark of eight bytes with the
/// version of the format, a length (u32), a time (u64), the bytes, and a check sum (u64). The check
/// sum is FNV-1a over length, time and bytes. If a process is killed or the machine loses power, an
/// incomplete last entry fails the check. After flipped bytes the next mark begins a readable
/// entry. Not thread-safe, except that add() may run beside write().
class JournalFile {
 public:
  /// Maximum size of the entries that wait while the disk is full [bytes].
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{64} << 20U;

  /// Begins a new journal in place of an existing one. Nothing is written before write().
  explicit JournalFile(std::filesystem::path file);
  /// Continues a journal that was read. The first write() cuts off its incomplete end.
  JournalFile(std::filesystem::path file, const JournalExtent& read);

  /// Stores an entry for the next write and returns its place. If an entry does not fit, it and all
  /// later entries are dropped, and the result is nullopt.
  std::optional<JournalPlace> add(const JournalEntry& entry, Stamp time);

  /// Collects the added entries for the next write(), unless collected entries are still waiting.
  /// False if write() has nothing to write.
  bool collect();
  /// Writes the collected entries to the disk, so that they survive a power failure, and closes the
  /// file, so that the disk can be unmounted. Throws std::system_error with one line that names the
  /// file and the reason; entries that are not written wait for the next call. Throws
  /// std::runtime_error if the file is gone, because a journal without its beginning is useless;
  /// entries wait for its return.
  void write();
  /// Collects and writes all entries.
  void sync() {
    while (collect()) write();
  }

  /// False after an entry has been dropped.
  [[nodiscard]] bool is_whole() const { return !full_; }

 private:
  const std::filesystem::path file_;
  std::optional<std::uintmax_t> keep_bytes_;  // size of the intact part, until the rest is cut off
  std::uint64_t end_bytes_;  // size of the file after all waiting entries are written
  std::string waiting_, collected_;
  bool full_ = false;
  bool is_begun_ = false;  // the file has entries of this process
};

}  // namespace km
