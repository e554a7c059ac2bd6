// The parser's state and its directives; an inner header of the scene language.
#pragma once

#include "loader/parser/current_transform.h"
#include "loader/parser/description.h"
#include "loader/parser/param_list.h"

#include <map>
#include <set>

namespace strobe {

/// Parses sources in order into one description.
class DirectiveParser {
  public:
    /// `isStrict`: false for what other programs write, where trifles are warned about.
    DirectiveParser(const std::set<std::string>& sharingNames, Diagnostics& messages, bool isStrict,
                    std::shared_ptr<const ResourcePolicy> guard);
    void parse(std::shared_ptr<const Source> source);
    /// A glTF file of the command line; it begins the world, if no file before it has.
    void parseGltf(const std::filesystem::path& path);
    /// Checks that everything is closed and settles the conventions.
    SceneDescription finish();

  private:
    /// A directive word where it stands.
    struct Call {
        std::string name;
        Location where;
    };
    enum class Block { Any, Options, World };
    struct Directive {
        Block block;
        void (DirectiveParser::*handle)(const Call&);
    };
    using Defaults = std::map<std::string, std::vector<Param>>;
    /// What AttributeBegin saves.
    struct State {
        CurrentTransform transform;
        int material = 0;
        int areaLight = -1;
        bool reverseOrientation = false;
        std::shared_ptr<const Defaults> defaults = std::make_shared<Defaults>(); ///< by kind, from Attribute
    };
    /// An open AttributeBegin, TransformBegin or ObjectBegin.
    struct Open {
        std::string name;
        Location where;
        State saved;
    };

    static const std::map<std::string, Directive, std::less<>>& directives();
    void parseSource(std::shared_ptr<const Source> source);
    void dispatch(const Token& word);
    void checkBlock(const Directive& directive, const Call& call) const;
    [[noreturn]] void failUnknown(const Token& word) const;

    // Arguments.
    /// Fails at the next token.
    [[noreturn]] void failFound(const Call& call, const std::string& needed);
    std::string readString(const Call& call, const char* what);
    double readNumber(const Call& call);
    template <size_t n>
    std::array<double, n> readNumbers(const Call& call, bool mayBracket = false);
    ParamSet readRawParameters(const Call& call);
    /// Parameters, with the defaults of `kind` and with textures looked up.
    ParamSet readParameters(const Call& call, const char* kind = nullptr);
    Statement readStatement(const Call& call, const char* kind = nullptr);
    /// False, with a warning, when it is unknown and the file is lenient.
    bool resolveTexture(Param& param);
    /// An Error in a strict file; in a lenient one, a warning that says how it goes on.
    void complain(const Location& where, const std::string& what, const std::string& soThat);

    // Transforms (transform_directives.cpp).
    void identity(const Call&);
    void translate(const Call&);
    void scale(const Call&);
    void rotate(const Call&);
    void lookAtDirective(const Call&);
    void transform(const Call&);
    void concatTransform(const Call&);
    void coordinateSystem(const Call&);
    void coordSysTransform(const Call&);
    void transformTimes(const Call&);
    void activeTransform(const Call&);

    // Blocks and files (parser.cpp).
    void beginBlock(const Call&);
    void endBlock(const Call&);
    void objectBegin(const Call&);
    void objectEnd(const Call&);
    void include(const Call&);
    void worldBegin(const Call&);
    void worldEnd(const Call&);
    void checkAllClosed() const;
    const Open& closeBlock(const Call&, const std::string& opener);
    bool untangle(const std::string& opener);

    // Options (option_directives.cpp).
    void setOnce(std::optional<Statement>& slot, Statement statement);
    void camera(const Call&);
    void film(const Call&);
    void sampler(const Call&);
    void pixelFilter(const Call&);
    void integrator(const Call&);
    void option(const Call&);
    void colorSpace(const Call&);
    void accelerator(const Call&);
    void skip(const Call&); ///< one name and parameters
    void skipMediumInterface(const Call&);
    void skipNotice(const Call&);

    // The world (world_directives.cpp).
    void attribute(const Call&);
    void reverseOrientation(const Call&);
    void material(const Call&);
    void makeNamedMaterial(const Call&);
    void namedMaterial(const Call&);
    void texture(const Call&);
    void lightSource(const Call&);
    void areaLightSource(const Call&);
    void shape(const Call&);
    void addGltf(GltfDecl decl);
    void objectInstance(const Call&);
    ObjectDecl& target() { return m_object < 0 ? m_desc.world : m_desc.objects[m_object]; }
    KeyedTransform keyed() const { return toKeyed(m_state.transform.keys(), m_desc.keyTimes); }

    const std::set<std::string>& m_sharingNames;
    Diagnostics& m_messages;
    const std::shared_ptr<const ResourcePolicy> m_guard;
    SceneDescription m_desc;
    State m_state;
    std::vector<Open> m_open;
    Lexer* m_lexer = nullptr;                   ///< of the file being read
    std::vector<std::filesystem::path> m_files; ///< being read, the innermost last
    bool m_isStrict;
    bool m_looksLikeV4 = false; ///< something only pbrt-v3 or v4 has was seen
    std::optional<Conventions> m_saidConventions;
    Location m_worldBegin, m_worldEnd, m_end;
    int m_object = -1; ///< the object being defined
    std::map<std::string, std::vector<M44d>> m_coordinateSystems;
    std::map<std::string, int> m_floatTextures, m_rgbTextures, m_namedMaterials, m_objects;
};

/// The keys of a map, for nearestName.
template <class Map>
std::vector<std::string> namesOf(const Map& map) {
    std::vector<std::string> names;
    for (const auto& entry : map)
        names.push_back(entry.first);
    return names;
}

/// `; did you mean "x"?`, or nothing.
std::string suggestion(std::string_view name, const std::vector<std::string>& names);
/// A name as messages show it.
std::string inQuotes(std::string_view name);

} // namespace strobe
