#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "modules/core/io/text_rows.hpp"

namespace km {

/// Counts of the faults that a reader found, with the first example of each kind. `Fault` is an
/// enumeration with a to_string that gives a short plural: "malformed rows".
template <typename Fault>
class FaultReport {
 public:
  struct Entry {
    std::size_t count = 0;
    std::string first;  ///< Names the place; one line.
  };

  /// Adds `count` faults, at least one.
  void add(Fault fault, const std::string& example, std::size_t count = 1) {
    constexpr std::size_t kMaxExample = 500;  // room for the paths of two files
    Entry& entry = entries_[fault];
    if (entry.count == 0) entry.first = readable(example, kMaxExample);
    entry.count += count;
  }

  /// Adds the faults of another reader.
  void add(const FaultReport& other) {
    for (const auto& [fault, entry] : other.entries_) {
      Entry& own = entries_[fault];
      if (own.count == 0) own.first = entry.first;
      own.count += entry.count;
    }
  }

  [[nodiscard]] std::size_t count(Fault fault) const {
    const auto entry = entries_.find(fault);
    return entry == entries_.end() ? 0 : entry->second.count;
  }

  [[nodiscard]] const std::map<Fault, Entry>& entries() const { return entries_; }
  [[nodiscard]] bool empty() const { return entries_.empty(); }

 private:
  std::map<Fault, Entry> entries_;
};

/// One line per kind of fault: "3 missing images, first: cam0/data.csv line 7: ...". Empty if there
/// is none.
template <typename Fault>
[[nodiscard]] std::string to_string(const FaultReport<Fault>& report) {
  std::string text;
  for (const auto& [fault, entry] : report.entries())
    text += std::to_string(entry.count) + ' ' + to_string(fault) + ", first: " + entry.first + '\n';
  return text;
}

}  // namespace km
