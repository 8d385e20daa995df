#include "modules/recordings/open_bag.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "modules/core/io/input_file.hpp"
#include "modules/recordings/chunked_file.hpp"
#include "modules/recordings/mcap_records.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kZstdMagic = "\x28\xB5\x2F\xFD";

// Decompresses the messages of rosbag2's --compression-mode message. An uncompressed message in CDR
// begins with zero.
class UnpackedReader final : public BagReader {
 public:
  UnpackedReader(const fs::path& path, std::unique_ptr<BagReader> reader)
      : name_(path.string()), reader_(std::move(reader)) {}

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return reader_->channels();
  }

  [[nodiscard]] std::optional<BagMessage> next() override {
    while (auto message = reader_->next()) {
      const BagChannel& channel = channels()[message->channel];
      if (channel.encoding != "cdr" || magic_of(message->bytes) != kZstdMagic) return message;
      auto bytes = decompress_message(message->bytes);
      if (!bytes.value) report_.add(BagFault::kCompression, name_ + ": " + channel.topic);
      if (!bytes.value) continue;
      message->bytes = *std::move(bytes.value);
      return message;
    }
    return std::nullopt;
  }

  [[nodiscard]] BagReport report() const override {
    BagReport report = reader_->report();
    report.add(report_);
    return report;
  }

 private:
  static std::string_view magic_of(const std::vector<std::uint8_t>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kZstdMagic.size())};
  }

  std::string name_;
  std::unique_ptr<BagReader> reader_;
  BagReport report_;
};

std::unique_ptr<BagReader> open_file(const fs::path& path) {
  constexpr std::uint64_t kMagic_bytes = 8;
  const RandomAccessFile file(path);
  if (file.size() == 0) throw InputFileError(path.string() + ": is empty");
  const std::string magic = file.beginning(kMagic_bytes);
  if (magic == "#ROSBAG ") return open_ros1_bag(path);
  if (magic == kMcapMagic) return std::make_unique<UnpackedReader>(path, open_mcap(path));
  if (magic == "SQLite f") return std::make_unique<UnpackedReader>(path, open_db3(path));
  if (magic.starts_with(kZstdMagic))
    throw InputFileError(path.string() + ": is compressed as a whole: zstd -d " + path.string());
  throw InputFileError(file.place(0) + ": does not begin like a .bag, .mcap or .db3 file");
}

// Files in the order of their numbers: bag_2 before bag_10.
std::vector<fs::path> files_of(const fs::path& folder, std::string_view extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == extension) files.push_back(entry->path());
  if (error) throw InputFileError(folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(a.native().size(), a) < std::pair(b.native().size(), b);
  });
  return files;
}

// Files that are compressed as a whole: rosbag2's .zstd, or .zst of the program zstd.
bool has_compressed(const fs::path& folder) {
  return !files_of(folder, ".zstd").empty() || !files_of(folder, ".zst").empty();
}

std::unique_ptr<BagReader> open_folder(const fs::path& folder) {
  std::vector<fs::path> files = files_of(folder, ".db3");
  const std::vector<fs::path> others = files_of(folder, ".mcap");
  if (!files.empty() && !others.empty())
    throw InputFileError(folder.string() + ": both .db3 and .mcap files: name the one to read");
  files.insert(files.end(), others.begin(), others.end());
  if (files.empty() && has_compressed(folder))
    throw InputFileError(folder.string() +
                         ": its files are compressed as a whole: zstd -d them (zstd -d " +
                         (folder / "*.zst*").string() + ')');
  if (files.empty()) throw InputFileError(folder.string() + ": no .db3 or .mcap file in it");
  std::vector<std::unique_ptr<BagReader>> readers;
  for (const fs::path& file : files) readers.push_back(open_file(file));
  return merge_bags(std::move(readers));
}

class MergedReader final : public BagReader {
 public:
  explicit MergedReader(std::vector<std::unique_ptr<BagReader>> readers) {
    for (auto& reader : readers) sources_.push_back({.reader = std::move(reader)});
    for (Source& source : sources_) add_channels(source);
    for (Source& source : sources_) advance(source);
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return channels_.channels();
  }

  [[nodiscard]] std::optional<BagMessage> next() override {
    Source* first = nullptr;
    for (Source& source : sources_)
      if (source.head && (first == nullptr || source.head->log_time < first->head->log_time))
        first = &source;
    if (first == nullptr) return std::nullopt;
    BagMessage message = *std::move(first->head);
    advance(*first);
    return message;
  }

  [[nodiscard]] BagReport report() const override {
    BagReport report;
    for (const Source& source : sources_) report.add(source.reader->report());
    return report;
  }

 private:
  struct Source {
    std::unique_ptr<BagReader> reader;
    std::vector<std::size_t> channel_of = {};  // merged channel of each channel of `reader`
    std::optional<BagMessage> head = {};
  };

  void add_channels(Source& source) {
    const auto& channels = source.reader->channels();
    for (std::size_t i = source.channel_of.size(); i < channels.size(); ++i)
      source.channel_of.push_back(channels_.add(channels[i]));
  }

  void advance(Source& source) {
    source.head = source.reader->next();
    add_channels(source);  // next() may find more
    if (source.head) source.head->channel = source.channel_of[source.head->channel];
  }

  std::vector<Source> sources_;
  ChannelTable channels_;
};

}  // namespace

bool may_be_bag(const fs::path& path) {
  if (!is_folder(path)) return true;
  return !files_of(path, ".db3").empty() || !files_of(path, ".mcap").empty() ||
         has_compressed(path);
}

std::unique_ptr<BagReader> open_bag(const fs::path& path) {
  return is_folder(path) ? open_folder(path) : open_file(path);
}

std::unique_ptr<BagReader> merge_bags(std::vector<std::unique_ptr<BagReader>> readers) {
  return std::make_unique<MergedReader>(std::move(readers));
}

}  // namespace km
