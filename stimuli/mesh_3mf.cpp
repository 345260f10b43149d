// 3D Manufacturing Format (.3mf), core specification 1.3: the items of the build, their components
// and transforms, the unit of the model. Objects in other parts of the package (production
// extension 1.1) are read too; materials, colours and thumbnails are skipped.

#include <expat.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
namespace {

// Reads the files of a ZIP archive in memory, through libzip.

/// Thrown to stop reading.
struct ZipRefused {
  std::string place;  ///< a file's name in the archive; empty: the archive
  std::string expected, found;
};

class ZipArchive {
 public:
  /// Files longer than this together are refused.
  static constexpr std::uint64_t kLongest = std::uint64_t{1} << 31U;

  /// Reads the directory. \param bytes  must live as long as the archive \throws ZipRefused
  explicit ZipArchive(std::string_view bytes);

  /// Names are compared without their case and without a slash in front (ECMA-376-2, 6.2.2.3).
  bool has(std::string_view name) const { return entries_.contains(key_of(name)); }
  std::size_t size() const { return entries_.size(); }
  std::uint64_t unpacked_size() const { return unpacked_; }  ///< bytes, of all files
  /// The form in which names are compared.
  static std::string key_of(std::string_view name);

  /// Hands over a file in pieces of at most 64 KiB, in order, until `take` returns false.
  /// \pre has(name) \throws ZipRefused: it is damaged, encrypted or packed by another method
  void read(std::string_view name, const std::function<bool(std::string_view)>& take) const;

 private:
  struct Entry {
    std::string name;
    std::uint64_t index = 0, unpacked = 0;
  };
  struct Discard {
    void operator()(zip* archive) const;
  };
  std::unique_ptr<zip, Discard> archive_;
  std::uint64_t unpacked_ = 0;
  std::map<std::string, Entry> entries_;
};

constexpr std::size_t kPiece = std::size_t{1} << 16U;

struct ZipError : zip_error_t {
  ZipError() : zip_error_t{} { zip_error_init(this); }
  ~ZipError() { zip_error_fini(this); }
  ZipError(const ZipError&) = delete;
  ZipError& operator=(const ZipError&) = delete;
};

struct CloseFile {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

void ZipArchive::Discard::operator()(zip* archive) const { zip_discard(archive); }

ZipArchive::ZipArchive(std::string_view bytes) {
  if (bytes.empty()) throw ZipRefused{"", "a ZIP archive", "an empty file"};
  ZipError error;
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
  if (archive_ == nullptr) {
    std::string why = zip_error_code_zip(&error) == ZIP_ER_NOZIP ? "another file, or one cut off"
                                                                 : zip_error_strerror(&error);
    zip_source_free(source);
    throw ZipRefused{"", "a ZIP archive", std::move(why)};
  }
  const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
  for (zip_uint64_t i = 0; std::cmp_less(i, count); ++i) {
    zip_stat_t about;
    zip_stat_init(&about);
    // A name is taken as its bytes stand.
    if (zip_stat_index(archive_.get(), i, ZIP_FL_ENC_RAW, &about) != 0 ||
        (about.valid & (ZIP_STAT_NAME | ZIP_STAT_SIZE)) != (ZIP_STAT_NAME | ZIP_STAT_SIZE))
      throw ZipRefused{"", "a name and a size of file " + std::to_string(i + 1), "none"};
    const Entry entry{about.name, i, about.size};
    if (entry.unpacked > kLongest - unpacked_)
      throw ZipRefused{in_quotes(entry.name), "at most 2 GiB in all files", "more"};
    unpacked_ += entry.unpacked;
    if (!entries_.try_emplace(key_of(entry.name), entry).second)
      throw ZipRefused{in_quotes(entry.name), "a name that no other file has", "it twice"};
  }
}

std::string ZipArchive::key_of(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  std::string key(name);
  for (char& c : key) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return key;
}

void ZipArchive::read(std::string_view name,
                      const std::function<bool(std::string_view)>& take) const {
  const Entry& entry = entries_.at(key_of(name));
  const auto refuse = [&entry](const char* why) {
    throw ZipRefused{in_quotes(entry.name), "a file that can be unpacked", why};
  };
  const std::unique_ptr<zip_file_t, CloseFile> file(
      zip_fopen_index(archive_.get(), entry.index, 0));
  if (file == nullptr) refuse(zip_strerror(archive_.get()));
  std::array<char, kPiece> piece{};
  std::uint64_t so_far = 0;
  for (;;) {
    const zip_int64_t got = zip_fread(file.get(), piece.data(), piece.size());
    if (got < 0) refuse(zip_file_strerror(file.get()));
    so_far += static_cast<std::uint64_t>(got);
    if (so_far > entry.unpacked || (got == 0 && so_far < entry.unpacked))
      throw ZipRefused{in_quotes(entry.name), std::to_string(entry.unpacked) + " bytes",
                       got == 0 ? std::to_string(so_far) : "more"};
    if (got == 0 || !take({piece.data(), static_cast<std::size_t>(got)})) return;
  }
}

/// Names of elements and attributes as expat gives them: namespace, a bar, name.
constexpr char kBar = '|';
constexpr std::string_view kCoreSpecification =
    "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
constexpr std::string_view kProduction =
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
/// Extensions that may be required: they say nothing of the surface, or it is read.
constexpr std::array<std::string_view, 4> kKnownExtensions = {
    kCoreSpecification, kProduction,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"};
constexpr std::string_view kRelationship =
    "http://schemas.openxmlformats.org/package/2006/relationships|Relationship";
constexpr std::string_view kModelType =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
constexpr const char* kRelationships = "_rels/.rels";

/// Thrown to stop reading, but never through expat.
struct ThreeMfRefused {
  std::string place, expected, found;
};

/// The attributes of an element, in expat's order.
class XmlAttributes {
 public:
  explicit XmlAttributes(const char* const* list) : list_(list) {}

  /// nullptr: there is none.
  const char* find(std::string_view name) const {
    for (const char* const* at = list_; *at != nullptr; at += 2) {
      if (name == *at) return at[1];
    }
    return nullptr;
  }

 private:
  const char* const* list_;
};

/// Reads one XML part of a package; what it holds is up to the class that inherits it.
class XmlPart {
 public:
  XmlPart(const XmlPart&) = delete;
  XmlPart& operator=(const XmlPart&) = delete;
  virtual ~XmlPart() { XML_ParserFree(parser_); }

  /// \throws ThreeMfRefused, ZipRefused
  void read(const ZipArchive& archive) {
    bool is_whole = true;
    archive.read(name_, [&](std::string_view piece) { return is_whole = parse(piece, false); });
    if (is_whole) is_whole = parse({}, true);
    if (thrown_ != nullptr) std::rethrow_exception(thrown_);
    if (!is_whole) refuse("XML", XML_ErrorString(XML_GetErrorCode(parser_)));
  }

 protected:
  explicit XmlPart(std::string name)
      : name_(std::move(name)), parser_(XML_ParserCreateNS(nullptr, kBar)) {
    if (parser_ == nullptr) throw std::bad_alloc();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, on_begin, on_end);
    XML_SetStartNamespaceDeclHandler(parser_, on_prefix);
    XML_SetStartDoctypeDeclHandler(parser_, on_doctype);
  }

  virtual void begin(std::string_view element, const XmlAttributes& attributes) = 0;
  virtual void end(std::string_view) {}
  virtual void prefix(const std::string&, const std::string&) {}

  const std::string& name() const { return name_; }
  std::string place_of_line(std::size_t line) const {
    return name_ + ": line " + std::to_string(line);
  }
  std::size_t line() const { return XML_GetCurrentLineNumber(parser_); }
  [[noreturn]] void refuse(const std::string& expected, const char* found) const {
    throw ThreeMfRefused{place_of_line(line()), expected,
                         found == nullptr ? "nothing" : in_quotes(found)};
  }

 private:
  bool parse(std::string_view piece, bool last) {
    return XML_Parse(parser_, piece.data(), static_cast<int>(piece.size()), last ? 1 : 0) ==
           XML_STATUS_OK;
  }

  // An exception is kept until expat has returned.
  template <class Step>
  static void guarded(void* self, Step step) {
    auto& part = *static_cast<XmlPart*>(self);
    if (part.thrown_ != nullptr) return;
    try {
      step(part);
    } catch (...) {
      part.thrown_ = std::current_exception();
      XML_StopParser(part.parser_, XML_FALSE);
    }
  }
  static void on_begin(void* self, const char* element, const char** attributes) {
    guarded(self, [&](XmlPart& part) { part.begin(element, XmlAttributes(attributes)); });
  }
  static void on_end(void* self, const char* element) {
    guarded(self, [&](XmlPart& part) { part.end(element); });
  }
  static void on_prefix(void* self, const char* prefix, const char* uri) {
    guarded(self, [&](XmlPart& part) {
      part.prefix(prefix == nullptr ? "" : prefix, uri == nullptr ? "" : uri);
    });
  }
  // 3MF core 2.3.3; entities could grow without end.
  static void on_doctype(void* self, const char*, const char*, const char*, int) {
    guarded(self, [](XmlPart& part) { part.refuse("no document type", "DOCTYPE"); });
  }

  std::string name_;
  XML_Parser parser_;
  std::exception_ptr thrown_;
};

/// Which part of the package is the model.
class PackageRelationships final : public XmlPart {
 public:
  PackageRelationships() : XmlPart(kRelationships) {}

  const std::string& model() const { return model_; }

 private:
  void begin(std::string_view element, const XmlAttributes& attributes) override {
    if (element != kRelationship || !model_.empty()) return;
    const char *type = attributes.find("Type"), *target = attributes.find("Target");
    if (type != nullptr && target != nullptr && type == kModelType) model_ = target;
  }

  std::string model_;
};

/// x' = linear x + shift, in the model's unit.
struct Placement {
  Mat3 linear{1};
  Vec3 shift{0};

  Placement within(const Placement& parent) const {
    return {parent.linear * linear, parent.linear * shift + parent.shift};
  }
};

/// Another object that is placed somewhere.
struct Reference {
  std::string part;  ///< of the package
  std::uint32_t object = 0;
  Placement placement;
  std::string place;  ///< in the file
};

struct ModelObject {
  std::string name, type, place;
  std::vector<Vec3> vertices;  ///< in the model's unit
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Reference> components;
};

double metres_of(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {{{"micron", 1e-6},
                                                                          {"millimeter", 1e-3},
                                                                          {"centimeter", 1e-2},
                                                                          {"inch", 0.0254},
                                                                          {"foot", 0.3048},
                                                                          {"meter", 1}}};
  for (const auto& [name, metres] : kUnits) {
    if (name == unit) return metres;
  }
  return 0;
}

/// A model part: its objects and what is built of them.
class ModelPart final : public XmlPart {
 public:
  ModelPart(std::string name, NumberPrecision& precision)
      : XmlPart(std::move(name)), precision_(precision) {}

  double metres() const { return metres_; }
  const std::map<std::uint32_t, ModelObject>& objects() const { return objects_; }
  const std::vector<Reference>& items() const { return items_; }

 private:
  // The words of an element's name in the core namespace; those of others are skipped.
  static std::string_view core_name(std::string_view element) {
    const bool core = element.size() > kCoreSpecification.size() &&
                      element.starts_with(kCoreSpecification) &&
                      element[kCoreSpecification.size()] == kBar;
    return core ? element.substr(kCoreSpecification.size() + 1) : std::string_view();
  }

  void prefix(const std::string& prefix, const std::string& uri) override {
    prefixes_[prefix] = uri;
  }

  void begin(std::string_view element, const XmlAttributes& attributes) override {
    const std::string_view kind = core_name(element);
    if (!begun_) {
      begin_model(kind, attributes);
    } else if (kind == "vertex") {
      add_vertex(attributes);
    } else if (kind == "triangle") {
      add_triangle(attributes);
    } else if (kind == "object") {
      begin_object(attributes);
    } else if (kind == "component") {
      object_of("component").components.push_back(reference(attributes));
    } else if (kind == "item") {
      items_.push_back(reference(attributes));
    }
  }

  void end(std::string_view element) override {
    if (core_name(element) != "object" || object_ == nullptr) return;
    if (object_->triangles.empty() && object_->components.empty())
      throw ThreeMfRefused{object_->place, "an object of triangles or components", "neither"};
    object_ = nullptr;
  }

  void begin_model(std::string_view kind, const XmlAttributes& attributes) {
    begun_ = true;
    if (kind != "model")
      refuse("a model of 3MF, core specification (" + std::string(kCoreSpecification) + ")",
             nullptr);
    if (const char* unit = attributes.find("unit"); unit != nullptr) {
      metres_ = metres_of(unit);
      if (metres_ == 0) refuse("micron, millimeter, centimeter, inch, foot or meter", unit);
    }
    const char* required = attributes.find("requiredextensions");
    for (const std::string_view word : words_of(required == nullptr ? "" : required)) {
      const std::string& uri = prefixes_[std::string(word)];
      if (std::find(kKnownExtensions.begin(), kKnownExtensions.end(), uri) ==
          kKnownExtensions.end()) {
        refuse("a file that requires no extension but production and materials",
               uri.empty() ? std::string(word).c_str() : uri.c_str());
      }
    }
  }

  void begin_object(const XmlAttributes& attributes) {
    const std::uint32_t id = whole(attributes, "id");
    const auto [at, is_new] = objects_.try_emplace(id);
    if (!is_new) refuse("an id that no other object has", attributes.find("id"));
    object_ = &at->second;
    const char *name = attributes.find("name"), *type = attributes.find("type");
    object_->name = name == nullptr ? "" : name;
    object_->type = type == nullptr ? "model" : type;
    object_->place = place_of_line(line());
  }

  ModelObject& object_of(const char* kind) {
    if (object_ == nullptr) refuse("an object around it", kind);
    return *object_;
  }

  double number_in(const XmlAttributes& attributes, const char* name) {
    const char* word = attributes.find(name);
    double value = 0;
    if (word == nullptr || !parse_number(word, value))
      refuse(std::string("a finite number ") + name, word);
    precision_.add(word, value);
    return value;
  }

  std::uint32_t whole(const XmlAttributes& attributes, const char* name) const {
    const char* word = attributes.find(name);
    const std::string_view text = word == nullptr ? "" : word;
    std::uint32_t value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || stop != text.data() + text.size() ||
        value > 0x7fffffff)
      refuse(std::string("a whole number ") + name + " below 2^31", word);
    return value;
  }

  void add_vertex(const XmlAttributes& attributes) {
    std::vector<Vec3>& vertices = object_of("vertex").vertices;
    const double x = number_in(attributes, "x"), y = number_in(attributes, "y");
    vertices.emplace_back(x, y, number_in(attributes, "z"));
  }

  void add_triangle(const XmlAttributes& attributes) {
    ModelObject& object = object_of("triangle");
    std::array<std::uint32_t, 3> corners{};
    constexpr std::array kNames = {"v1", "v2", "v3"};
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[i] = whole(attributes, kNames[i]);
      if (corners[i] >= object.vertices.size()) {
        refuse("numbers of vertices below " + std::to_string(object.vertices.size()),
               attributes.find(kNames[i]));
      }
    }
    object.triangles.push_back(corners);
  }

  Reference reference(const XmlAttributes& attributes) const {
    static const std::string kPath = std::string(kProduction) + kBar + "path";
    const char *path = attributes.find(kPath), *transform = attributes.find("transform");
    return {path == nullptr ? name() : path, whole(attributes, "objectid"),
            transform == nullptr ? Placement() : placement(transform), place_of_line(line())};
  }

  // Twelve numbers: rows of a matrix that stands behind a row vector (core 3.3).
  Placement placement(const char* text) const {
    const std::vector<std::string_view> words = words_of(text);
    std::array<double, 12> m{};
    bool all = words.size() == m.size();
    for (std::size_t i = 0; all && i < m.size(); ++i) all = parse_number(words[i], m[i]);
    if (!all) refuse("a transform of twelve finite numbers", text);
    const auto row = [&](std::size_t i) { return Vec3(m[3 * i], m[3 * i + 1], m[3 * i + 2]); };
    Placement placement{Mat3(row(0), row(1), row(2)), row(3)};
    if (glm::determinant(placement.linear) == 0) refuse("a transform that leaves a solid", text);
    return placement;
  }

  NumberPrecision& precision_;
  bool begun_ = false;
  double metres_ = 1e-3;
  std::map<std::string, std::string> prefixes_;
  std::map<std::uint32_t, ModelObject> objects_;
  ModelObject* object_ = nullptr;  // that is being read
  std::vector<Reference> items_;
};

/// Puts the objects of all items into one soup, each mesh a group.
class ThreeMfReader {
 public:
  explicit ThreeMfReader(std::string_view bytes)
      : archive_(bytes), most_(std::max(kAlwaysPlaced, archive_.unpacked_size() / kLeastText)) {
    const std::size_t most = std::max(kAlwaysUnpacked, bytes.size() * kMostPacked);
    if (archive_.unpacked_size() <= most) return;
    throw ThreeMfRefused{"", "files of at most " + std::to_string(most) + " bytes when unpacked",
                         std::to_string(archive_.unpacked_size()) + " (packed to waste memory)"};
  }

  PolygonSoup read() {
    const ModelPart& root = part(model_name(), kRelationships);
    metres_ = root.metres();
    for (const Reference& item : root.items()) add(item, Placement(), 0);
    if (soup_.faces.empty())
      throw ThreeMfRefused{"", "an item in the build that is an object of the type model", "none"};
    soup_.coordinate_error = precision_.coordinate_error() * scale_ * metres_;
    if (soup_.group_names.size() == 1) {
      soup_.group_names.clear();
      soup_.group_of.clear();
    }
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    return std::move(soup_);
  }

 private:
  std::string model_name() const {
    if (!archive_.has(kRelationships)) {
      throw ThreeMfRefused{kRelationships, "a 3MF package, which has this part",
                           "an archive of " + std::to_string(archive_.size()) + " other files"};
    }
    PackageRelationships relationships;
    relationships.read(archive_);
    if (relationships.model().empty())
      throw ThreeMfRefused{kRelationships, "the relationship to a 3D model", "none"};
    return relationships.model();
  }

  const ModelPart& part(const std::string& name, const std::string& place) {
    std::unique_ptr<ModelPart>& known = parts_[ZipArchive::key_of(name)];
    if (known != nullptr) return *known;
    if (!archive_.has(name))
      throw ThreeMfRefused{place, "the name of a file in the archive", in_quotes(name)};
    auto read = std::make_unique<ModelPart>(name.substr(name.starts_with('/') ? 1 : 0), precision_);
    read->read(archive_);
    known = std::move(read);
    return *known;
  }

  void add(const Reference& reference, const Placement& parent, int depth) {
    const ModelPart& source = part(reference.part, reference.place);
    if (source.metres() != metres_)
      throw ThreeMfRefused{reference.place, "one unit in all parts of the package",
                           "another in " + in_quotes(reference.part)};
    const auto at = source.objects().find(reference.object);
    if (at == source.objects().end())
      throw ThreeMfRefused{reference.place, "the id of an object",
                           std::to_string(reference.object)};
    const ModelObject& object = at->second;
    require_room(1, placed_++, "objects", object);
    // Support is made by a slicer and taken off; "other" may not be placed at all.
    if (object.type == "support" || object.type == "other") return;
    if (depth > kMostWithin)
      throw ThreeMfRefused{reference.place, "objects within at most 100 others", "a deeper one"};
    const Placement placement = reference.placement.within(parent);
    if (!object.triangles.empty()) add_mesh(reference.object, object, placement);
    for (const Reference& component : object.components) add(component, placement, depth + 1);
  }

  void require_room(std::size_t count, std::size_t so_far, const char* what,
                    const ModelObject& object) const {
    if (count <= most_ - so_far) return;
    throw ThreeMfRefused{
        object.place,
        "at most " + std::to_string(most_) + " " + what + " in all items, for a file of this size",
        "more"};
  }

  void add_mesh(std::uint32_t id, const ModelObject& object, const Placement& placement) {
    require_room(object.vertices.size(), soup_.vertices.size(), "vertices", object);
    require_room(object.triangles.size(), soup_.faces.size(), "triangles", object);
    const auto group = static_cast<std::uint32_t>(soup_.group_names.size());
    const std::string number = "object " + std::to_string(id);
    soup_.group_names.push_back(object.name.empty() ? number : object.name);
    names_.places.push_back(number + (object.name.empty() ? "" : " " + in_quotes(object.name)));
    const auto start = static_cast<std::uint32_t>(soup_.vertices.size());
    for (int axis = 0; axis < 3; ++axis)
      scale_ = std::max(scale_, glm::length(placement.linear[axis]));
    for (const Vec3& v : object.vertices) {
      const Vec3 placed = metres_ * (placement.linear * v + placement.shift);
      if (!std::isfinite(placed.x + placed.y + placed.z))
        throw ThreeMfRefused{object.place, "finite coordinates where it is placed", "others"};
      names_.vertices.push_back({static_cast<std::uint32_t>(soup_.vertices.size()) - start, group});
      soup_.vertices.push_back(placed);
    }
    const bool mirrored = glm::determinant(placement.linear) < 0;
    for (std::uint32_t i = 0; i < object.triangles.size(); ++i) {
      const auto& [a, b, c] = object.triangles[i];
      names_.faces.push_back({i, group});
      soup_.faces.push_back({start + a, start + (mirrored ? c : b), start + (mirrored ? b : c)});
      soup_.group_of.push_back(group);
    }
  }

  // Memory stays in proportion to the file. A vertex or triangle takes more bytes of text than the
  // least; texts of a regular solid are packed to a fiftieth.
  static constexpr std::size_t kAlwaysPlaced = std::size_t{1} << 17U, kLeastText = 20;
  static constexpr std::size_t kAlwaysUnpacked = std::size_t{1} << 24U, kMostPacked = 100;
  static constexpr int kMostWithin = 100;

  ZipArchive archive_;
  std::size_t most_;  // vertices, and triangles
  NumberPrecision precision_;
  std::map<std::string, std::unique_ptr<ModelPart>> parts_;
  double metres_ = 1e-3, scale_ = 0;
  std::size_t placed_ = 0;  // objects
  PolygonSoup soup_;
  MeshNames names_;
};

}  // namespace

PolygonSoup read_3mf(std::string_view bytes, FileFaults& faults) {
  try {
    return ThreeMfReader(bytes).read();
  } catch (const ThreeMfRefused& refused) {
    faults.add(refused.place, refused.expected, refused.found);
  } catch (const ZipRefused& refused) {
    faults.add(refused.place, refused.expected, refused.found);
  }
  return {};
}

}  // namespace palpate::stimuli
