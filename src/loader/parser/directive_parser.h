// The state of the parser and its handlers of directives. Internal to this room.
#pragma once

#include "core/util/diagnostics.h"
#include "loader/parser/current_transform.h"
#include "loader/parser/description.h"
#include "loader/parser/param_list.h"
#include "loader/parser/scene_values.h"

#include <map>
#include <set>

namespace strobe {

/// Parses sources in order into one description. Unusable after an Error.
class DirectiveParser {
  public:
    /// `isStrict`: whether harmless mistakes, common in exported files, are Errors instead of warnings.
    DirectiveParser(const std::set<std::string>& sharingNames, Diagnostics& diagnostics, bool isStrict,
                    std::shared_ptr<const ResourcePolicy> policy, SceneValues values);
    void parse(std::shared_ptr<const Source> source);
    /// Adds a glTF file of the command line; begins the world if WorldBegin is still missing.
    void parseGltf(const std::filesystem::path& path);
    /// Checks that all blocks are closed, determines the conventions and returns the description.
    SceneDescription finish();

  private:
    /// An occurrence of a directive.
    struct Call {
        std::string name;
        Location where;
    };
    enum class Section { Any, Options, World }; ///< Options: before WorldBegin; World: after it
    struct Directive {
        Section section;
        void (DirectiveParser::*handle)(const Call&);
    };
    using Defaults = std::map<std::string, std::vector<Param>>;
    /// The graphics state, which AttributeBegin saves.
    struct State {
        CurrentTransform transform;
        std::shared_ptr<const Error> transformError; ///< why `transform` cannot be used; null: it can
        int material = 0;
        int areaLight = -1;
        bool reverseOrientation = false;
        int insideMedium = -1, outsideMedium = -1; ///< indices into SceneDescription::media; -1: vacuum
        std::shared_ptr<const Defaults> defaults = std::make_shared<Defaults>(); ///< of Attribute, by target
    };
    /// An open AttributeBegin, TransformBegin or ObjectBegin.
    struct OpenBlock {
        std::string name;
        Location where;
        State saved;
    };

    static const std::map<std::string, Directive, std::less<>>& directives();
    void parseSource(std::shared_ptr<const Source> source);
    void dispatch(const Token& word);
    void checkSection(const Directive& directive, const Call& call) const;
    [[noreturn]] void failUnknown(const Token& word) const;

    // Arguments.
    /// Throws "DIRECTIVE needs NEEDED, found TOKEN" at the next token.
    [[noreturn]] void failFound(const Call& call, const std::string& needed);
    std::string readString(const Call& call, const char* noun);
    double readNumber(const Call& call);
    template <size_t n>
    std::array<double, n> readNumbers(const Call& call, bool allowBrackets = false);
    ParamSet readRawParameters(const Call& call);
    /// Reads parameters, resolves textures and adds the defaults that Attribute set for `target`.
    ParamSet readParameters(const Call& call, const char* target = nullptr);
    Statement readStatement(const Call& call, const char* target = nullptr);
    /// Sets the indices of the texture that `param` names. Returns false, with a warning, if the texture is
    /// unknown and the file lenient.
    bool resolveTexture(Param& param);
    /// Throws an Error in a strict file; in a lenient file, warns "MISTAKE (CONSEQUENCE)", once for each
    /// mistake.
    void reportMistake(const Location& where, const std::string& mistake, const std::string& consequence);

    // Transforms (transform_directives.cpp).
    template <class F>
    void changeTransform(const F& change);
    void requireTransform() const;
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
    std::vector<float> readTimes(const Call&);
    bool hasAnimatedTransform() const;
    void activeTransform(const Call&);
    void warnOfMiddleKeys();

    // Blocks and files (parser.cpp).
    void beginBlock(const Call&);
    void endBlock(const Call&);
    void objectBegin(const Call&);
    void objectEnd(const Call&);
    void include(const Call&);
    void worldBegin(const Call&);
    void worldEnd(const Call&);
    void checkAllClosed() const;
    bool isVersion3() const;
    const OpenBlock& closeBlock(const Call&, const std::string& opener);
    bool reorderBlocks(const std::string& opener);

    // Options (option_directives.cpp).
    void setOnce(std::optional<Statement>& slot, Statement statement);
    void camera(const Call&);
    void film(const Call&);
    void sampler(const Call&);
    void pixelFilter(const Call&);
    void integrator(const Call&);
    void option(const Call&);
    void defaultValue(const Call&);
    void colorSpace(const Call&);
    void accelerator(const Call&);
    void ignore(const Call&); ///< of directives with one name and parameters
    void warnIgnored(const Call&);

    // Media (medium_directives.cpp).
    void makeNamedMedium(const Call&);
    void mediumInterface(const Call&);
    int readMedium(const Call&); ///< reads a name; -1: vacuum

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
    /// Returns the current transform. Reports if only some of its keys mirror.
    KeyedTransform keyed(const Location& where);

    const std::set<std::string>& m_sharingNames;
    Diagnostics& m_diagnostics;
    const std::shared_ptr<const ResourcePolicy> m_policy;
    SceneValues m_values;
    SceneDescription m_desc;
    State m_state;
    std::vector<OpenBlock> m_openBlocks;
    Lexer* m_lexer = nullptr;                   ///< of the current file
    std::vector<Lexer*> m_outerLexers;          ///< of the files that include it, outermost first
    std::vector<std::filesystem::path> m_files; ///< chain of includes; the current file is last
    bool m_isStrict;
    Location m_endKeysChosen; ///< the first StartTime or EndTime with more than two keys
    bool m_choosesKeysByNumber = false;
    bool m_looksLikeV2 = false;                        ///< the files contain directives of pbrt-v2 only
    bool m_looksLikeV4 = false;                        ///< the files contain notation of pbrt-v3 or v4
    std::optional<Conventions> m_requestedConventions; ///< of Option "conventions"
    Location m_worldBegin, m_worldEnd, m_end;
    int m_object = -1; ///< index of the object being defined; -1: none
    std::map<std::string, std::vector<M44d>> m_coordinateSystems;
    std::map<std::string, int> m_floatTextures, m_rgbTextures, m_namedMaterials, m_objects, m_media;
};

/// Returns the keys of a map.
template <class Map>
std::vector<std::string> namesOf(const Map& map) {
    std::vector<std::string> names;
    for (const auto& entry : map)
        names.push_back(entry.first);
    return names;
}

/// Returns `; did you mean "x"?` for the nearest of `names`, or an empty string if none is near.
std::string suggestion(std::string_view name, const std::vector<std::string>& names);
/// Returns a name in quotes for diagnostics, shortened and printable.
std::string inQuotes(std::string_view name);

} // namespace strobe
