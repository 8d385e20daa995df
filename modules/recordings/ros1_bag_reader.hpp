#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/channel_table.hpp"
#include "modules/recordings/chunk_merge.hpp"
#include "modules/recordings/decompress.hpp"
#include "modules/recordings/placed_report.hpp"
#include "modules/recordings/random_access_file.hpp"
#include "modules/recordings/ros1_records.hpp"

namespace km {

/// Reads bags of ROS 1, version 2.0: chunks that are not compressed, or by bz2 or lz4. With the
/// index at the end, a chunk is read when its first message is due. A bag without an index, whose
/// recorder was killed, is read once before the first message and yields its complete chunks.
class Ros1BagReader final : public BagReader {
 public:
  /// Throws InputFileError if `path` is no file, does not begin with kRos1Magic, or is encrypted.
  explicit Ros1BagReader(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return channels_.channels();
  }
  [[nodiscard]] std::optional<BagMessage> next() override { return merge_->next(); }
  [[nodiscard]] BagReport report() const override { return report_.faults(); }

 private:
  // Header of a record, and position of its data in the file.
  struct Place {
    std::vector<std::uint8_t> header;  // bytes to which `fields` refer
    Ros1Fields fields;
    std::uint64_t data_begin = 0;
    std::uint32_t data_size = 0;
  };
  // The record at `begin`; nullopt if there is no record that ends before `end`.
  [[nodiscard]] std::optional<Place> record_at(std::uint64_t begin, std::uint64_t end) const;

  // Reason why the index cannot be used, or null.
  [[nodiscard]] const char* read_index(const Place& bag_header);
  [[nodiscard]] const char* use_chunk_infos(std::vector<Ros1ChunkInfo> infos, std::uint64_t begin,
                                            std::uint64_t end);
  void read_all(std::uint64_t begin);
  void note_chunk(std::uint64_t begin, std::uint64_t end);

  [[nodiscard]] Chunk load(const ChunkRange& place);
  [[nodiscard]] std::vector<std::uint8_t> records_of(const ChunkRange& place);
  void add_connection(const Ros1Record& record, std::uint64_t place);
  void add_entry(const Ros1Record& record, std::uint64_t place, Chunk& chunk);

  RandomAccessFile file_;
  PlacedReport report_{file_};
  UnpackLimit unpack_limit_{file_.size()};
  ChannelTable channels_;
  std::map<std::uint32_t, std::size_t> channel_of_;  // channel of each connection of the bag
  std::vector<ChunkRange> places_;
  std::unique_ptr<ChunkMerge> merge_;
};

}  // namespace km
