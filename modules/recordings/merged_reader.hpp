#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/recordings/channel_table.hpp"

namespace km {

/// Several files of one recording as one stream. Messages of equal time are in the order of the
/// files.
class MergedReader final : public BagReader {
 public:
  explicit MergedReader(std::vector<std::unique_ptr<BagReader>> readers);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return channels_.channels();
  }
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override;

 private:
  struct Source {
    std::unique_ptr<BagReader> reader;
    std::vector<std::size_t> channel_of;  // merged channel of each channel of `reader`
    std::optional<BagMessage> head;
  };
  void advance(Source& source);

  std::vector<Source> sources_;
  ChannelTable channels_;
};

}  // namespace km
