#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// Semantic class of a surface, as stored in label images.
using LabelId = std::uint8_t;

/// One semantic class and how it is drawn.
struct LabelClass {
  LabelId id = 0;
  std::string name;
  std::array<std::uint8_t, 3> color = {0, 0, 0};  ///< red, green, blue
};

/// The classes of a recording or a map: ids are unique, id 0 is `unknown`.
class LabelPalette {
 public:
  LabelPalette() = default;

  /// Throws std::invalid_argument for two classes of one id with different colours. A class named
  /// twice under one id (Kimera-Semantics maps several objects to one label) keeps its first name.
  explicit LabelPalette(const std::vector<LabelClass>& classes);

  [[nodiscard]] const std::vector<LabelClass>& classes() const { return classes_; }  ///< By id.

  /// nullptr if no class has this id.
  [[nodiscard]] const LabelClass* find(LabelId id) const;

  /// The class drawn in this colour; nullopt if there is none.
  [[nodiscard]] std::optional<LabelId> id_of(const std::array<std::uint8_t, 3>& color) const;

 private:
  std::vector<LabelClass> classes_;
};

/// Parses `name,red,green,blue,alpha,id` with a header row (Kimera-Semantics' format). Throws
/// std::invalid_argument that names `source`, line and value.
[[nodiscard]] LabelPalette parse_label_palette(std::string_view csv, std::string_view source);

/// The same format, read back unchanged by parse_label_palette().
[[nodiscard]] std::string to_csv(const LabelPalette& palette);

}  // namespace km
