#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/chunk_merge.hpp"
#include "modules/recordings/decompress.hpp"
#include "modules/recordings/mcap_records.hpp"
#include "modules/recordings/placed_report.hpp"
#include "modules/recordings/random_access_file.hpp"

namespace km {

/// Reads MCAP files (mcap.dev/spec), version 0: messages in chunks (not compressed, lz4, zstd) and
/// outside of them. If the summary at the end describes all channels and chunks, a chunk is read
/// when its first message is due. Otherwise the whole file is read once before the first message. A
/// file without an end, whose writer was killed, yields its complete parts. The reader verifies the
/// checksums of the summary, of chunks, and of a data section with messages outside of chunks, if
/// present. Attachments, metadata and records of other kinds are skipped.
class McapReader final : public BagReader {
 public:
  /// Throws InputFileError if `path` is no file or does not begin with kMcapMagic.
  explicit McapReader(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override { return merge_->next(); }
  [[nodiscard]] BagReport report() const override { return report_.faults(); }

 private:
  struct Summary {
    std::vector<McapChunkIndex> chunks;  // chunks in the order of the file
    std::optional<McapStatistics> statistics;
  };

  // The end of the data section. Sets summary_ if it describes all channels and chunks.
  [[nodiscard]] std::uint64_t find_data_end();
  void read_summary(std::uint64_t begin, std::uint64_t footer, const McapFooter& fields);
  [[nodiscard]] const char* misfit_of(Summary& summary, std::uint64_t data_end) const;
  [[nodiscard]] bool describes_all(const Summary& summary) const;
  void use_summary();

  // Reads the records between indexed chunks, or all records.
  void walk(std::uint64_t begin, std::uint64_t end, bool has_end);
  void note_bare_message(std::uint64_t begin, std::uint64_t end);
  void note_chunk(std::uint64_t begin, std::uint64_t end);
  void check_data_crc(std::uint64_t end, std::uint32_t crc);

  [[nodiscard]] Chunk load(const ChunkRange& place);
  [[nodiscard]] std::vector<std::uint8_t> records_of(const ChunkRange& place);
  void add_definition(const McapRecordHeader& header, std::span<const std::uint8_t> bytes,
                      std::uint64_t place);
  void add_channel(const McapChannel& channel, std::uint64_t place);

  RandomAccessFile file_;
  PlacedReport report_{file_};
  UnpackLimit unpack_limit_{file_.size()};
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::size_t> channel_of_;  // index into channels_
  std::vector<BagChannel> channels_;
  std::optional<Summary> summary_;
  std::vector<ChunkRange> places_;
  std::unique_ptr<ChunkMerge> merge_;
};

/// The attachments of an MCAP file by name; of several with one name, the last. A truncated file
/// yields its complete attachments. Throws InputFileError if the file is no MCAP file, or if an
/// attachment is damaged.
[[nodiscard]] std::map<std::string, std::string> read_mcap_attachments(
    const std::filesystem::path& path);

}  // namespace km
