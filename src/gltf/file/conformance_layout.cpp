#include "gltf/file/conformance_items.h"
#include "gltf/file/json_access.h"

#include <map>
#include <set>

namespace strobe::gltf {
namespace {

constexpr int kUnsignedInt = 5125, kFloat = 5126, kIndexTarget = 34963;

/// Returns the bytes of a component; 0: unknown.
uint64_t componentBytes(const json& accessor) {
    const json& type = get(accessor, "componentType");
    if (!type.is_number_unsigned())
        return 0;
    switch (type.get<uint64_t>()) {
    case 5120:
    case 5121:
        return 1;
    case 5122:
    case 5123:
        return 2;
    case kUnsignedInt:
    case kFloat:
        return 4;
    default:
        return 0;
    }
}

/// Returns the bytes of an element; 0: unknown. Columns of matrices begin at multiples of 4 bytes.
uint64_t elementBytes(const json& accessor) {
    static const std::map<std::string, std::pair<int, int>> columnsAndRows{
        {"SCALAR", {1, 1}}, {"VEC2", {1, 2}}, {"VEC3", {1, 3}}, {"VEC4", {1, 4}},
        {"MAT2", {2, 2}},   {"MAT3", {3, 3}}, {"MAT4", {4, 4}}};
    const json& type = get(accessor, "type");
    const auto it = type.is_string() ? columnsAndRows.find(type.get<std::string>()) : columnsAndRows.end();
    if (it == columnsAndRows.end())
        return 0;
    const uint64_t column = uint64_t(it->second.second) * componentBytes(accessor);
    return it->second.first == 1 ? column : uint64_t(it->second.first) * ((column + 3) / 4 * 4);
}

uint64_t integer(const json& value, const char* member) {
    const json& n = get(value, member);
    return n.is_number_unsigned() ? n.get<uint64_t>() : 0;
}

class LayoutChecker {
  public:
    LayoutChecker(const json& root, Deviations& out) : m_root(root), m_out(out) {}

    void check() {
        const json& buffers = listIn(m_root, "buffers");
        for (size_t i = 0; i < buffers.size(); ++i)
            checkLength(buffers[i], item("buffers", i));
        const json& views = listIn(m_root, "bufferViews");
        for (size_t i = 0; i < views.size(); ++i)
            checkView(views[i], item("bufferViews", i));
        const json& accessors = listIn(m_root, "accessors");
        for (size_t i = 0; i < accessors.size(); ++i)
            checkAccessor(accessors[i], item("accessors", i));
        for (const json& mesh : listIn(m_root, "meshes"))
            for (const json& primitive : listIn(mesh, "primitives"))
                addUses(primitive);
        checkUses();
        checkRawViews();
    }

  private:
    /// How primitives use a buffer view.
    struct Uses {
        bool forIndices = false;
        std::set<uint64_t> attributes; ///< accessors
    };

    static std::string item(const char* list, size_t index) {
        return std::string(list) + "[" + std::to_string(index) + "]";
    }
    void add(const std::string& path, const std::string& message) { m_out.emplace_back(path, message); }

    void checkLength(const json& value, const std::string& path) {
        if (get(value, "byteLength") == 0)
            add(path + ".byteLength", "must not be 0");
    }
    void checkView(const json& v, const std::string& path) {
        checkLength(v, path);
        const json& buffer = itemOf(m_root, "buffers", get(v, "buffer"));
        if (buffer.is_object() &&
            integer(v, "byteOffset") + integer(v, "byteLength") > integer(buffer, "byteLength"))
            add(path, "exceeds its buffer");
        if (has(v, "byteStride") && get(v, "target") == kIndexTarget)
            add(path + ".byteStride", "must not be set for indices");
        if (integer(v, "byteStride") > integer(v, "byteLength"))
            add(path + ".byteStride", "exceeds the byteLength");
    }

    void checkAccessor(const json& a, const std::string& path) {
        const json& type = get(a, "componentType");
        if (get(a, "normalized") == true && (type == kFloat || type == kUnsignedInt))
            add(path + ".normalized", "must not be true for this componentType");
        if (has(a, "byteOffset") && !has(a, "bufferView"))
            add(path + ".byteOffset", "needs a bufferView");
        if (get(a, "count") == 0)
            add(path + ".count", "must not be 0");
        checkData(a, path);
        const json& sparse = get(a, "sparse");
        if (sparse.is_object() && integer(sparse, "count") > integer(a, "count"))
            add(path + ".sparse.count", "exceeds the count of the accessor");
        for (const char* list : {"indices", "values"})
            if (has(itemOf(m_root, "bufferViews", get(get(sparse, list), "bufferView")), "byteStride"))
                add(path + ".sparse." + list + ".bufferView", "must not have a byteStride");
    }
    /// Checks the place of the elements in their buffer view.
    void checkData(const json& a, const std::string& path) {
        const json& view = itemOf(m_root, "bufferViews", get(a, "bufferView"));
        const uint64_t component = componentBytes(a), size = elementBytes(a), count = integer(a, "count");
        if (!view.is_object() || component == 0 || size == 0 || count == 0)
            return;
        const uint64_t offset = integer(a, "byteOffset"), begin = offset + integer(view, "byteOffset");
        const uint64_t stride = has(view, "byteStride") ? integer(view, "byteStride") : size;
        if (offset % component || begin % component)
            add(path + ".byteOffset", "is not aligned to the size of a component");
        if (stride < size)
            add(path, "elements have " + std::to_string(size) + " bytes, more than the byteStride");
        if (offset + stride * (count - 1) + size > integer(view, "byteLength"))
            add(path, "exceeds its buffer view");
    }

    void addUses(const json& primitive) {
        if (Uses* uses = usesOf(get(primitive, "indices")))
            uses->forIndices = true;
        addAttributes(get(primitive, "attributes"));
        for (const json& target : listIn(primitive, "targets"))
            addAttributes(target);
    }
    void addAttributes(const json& attributes) {
        if (!attributes.is_object())
            return;
        for (const json& accessor : attributes)
            if (Uses* uses = usesOf(accessor))
                uses->attributes.insert(accessor.get<uint64_t>());
    }
    /// Returns the uses of the view of an accessor; null if there is none.
    Uses* usesOf(const json& accessor) {
        const json& view = get(itemOf(m_root, "accessors", accessor), "bufferView");
        return view.is_number_unsigned() ? &m_uses[view.get<uint64_t>()] : nullptr;
    }
    void checkUses() {
        for (const auto& [index, uses] : m_uses) {
            const json& view = itemOf(m_root, "bufferViews", index);
            const std::string path = item("bufferViews", index);
            const bool isForIndices = uses.forIndices || get(view, "target") == kIndexTarget;
            if (isForIndices && !uses.attributes.empty())
                add(path, "has both indices and attributes");
            if (uses.forIndices && has(view, "byteStride") && get(view, "target") != kIndexTarget)
                add(path + ".byteStride", "must not be set for indices");
            if (uses.attributes.size() > 1 && !has(view, "byteStride"))
                add(path, "needs a byteStride, since several attributes use it");
            for (const uint64_t accessor : uses.attributes)
                if (integer(itemOf(m_root, "accessors", accessor), "byteOffset") % 4)
                    add(item("accessors", accessor) + ".byteOffset",
                        "must be a multiple of 4 for attributes");
        }
    }

    /// Checks the views of images and of inverse bind matrices.
    void checkRawViews() {
        const auto check = [&](const json& index, const std::string& path) {
            if (has(itemOf(m_root, "bufferViews", index), "byteStride"))
                add(path, "must not use a buffer view with a byteStride");
        };
        const json& images = listIn(m_root, "images");
        for (size_t i = 0; i < images.size(); ++i)
            check(get(images[i], "bufferView"), item("images", i));
        const json& skins = listIn(m_root, "skins");
        for (size_t i = 0; i < skins.size(); ++i)
            check(get(itemOf(m_root, "accessors", get(skins[i], "inverseBindMatrices")), "bufferView"),
                  item("skins", i) + ".inverseBindMatrices");
    }

    const json& m_root;
    Deviations& m_out;
    std::map<uint64_t, Uses> m_uses; ///< by buffer view
};

} // namespace

void checkLayout(const json& root, Deviations& out) { LayoutChecker(root, out).check(); }

} // namespace strobe::gltf
