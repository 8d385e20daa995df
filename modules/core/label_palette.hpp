#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace km {

/// Semantic class of a surface, as stored in label images. 0 means unknown, whatever its name.
using LabelId = std::uint8_t;

/// One semantic class and how it is drawn.
struct LabelClass {
  LabelId id = 0;
  std::string name;
  std::array<std::uint8_t, 3> color = {0, 0, 0};  ///< red, green, blue
};

/// The classes of a recording or a map: one per id. Several colours may stand for one class, since
/// Kimera-Semantics' tables list objects (a chair, a table) under the label they count as
/// (furniture): the first entry of an id names and draws the class, the colours of the others are
/// recognised by id_of().
class LabelPalette {
 public:
  LabelPalette() = default;

  /// Throws std::invalid_argument for a colour that stands for two ids, and for a name that a table
  /// could not hold: empty, with surrounding blanks, or with a comma, `#` or line end in it.
  explicit LabelPalette(const std::vector<LabelClass>& entries);

  [[nodiscard]] const std::vector<LabelClass>& classes() const { return classes_; }  ///< By id.

  /// nullptr if no class has this id.
  [[nodiscard]] const LabelClass* find(LabelId id) const;

  /// The class drawn in this colour or listed under it; nullopt if there is none.
  [[nodiscard]] std::optional<LabelId> id_of(const std::array<std::uint8_t, 3>& color) const;

  /// Every distinct (id, name, colour), what draws an id before what only counts as it.
  [[nodiscard]] std::vector<LabelClass> entries() const;

 private:
  std::vector<LabelClass> classes_;
  std::vector<LabelClass> others_;  // listed under an id after its first colour, by id
  std::vector<std::pair<std::uint32_t, LabelId>> id_by_color_;  // sorted by 0xRRGGBB
};

/// Parses `name,red,green,blue,alpha,id` with a header row (Kimera-Semantics' format); alpha is
/// checked and dropped, `#` starts a comment. Of the names with one colour and id the first is
/// kept. Throws std::invalid_argument that names `source`, line and value.
[[nodiscard]] LabelPalette parse_label_palette(std::string_view csv, std::string_view source);

/// The same format, read back unchanged by parse_label_palette().
[[nodiscard]] std::string to_csv(const LabelPalette& palette);

}  // namespace km
