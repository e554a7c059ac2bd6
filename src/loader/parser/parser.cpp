// Files, blocks and the table of directives.
#include "loader/parser/parser.h"

#include "core/util/file_bytes.h"
#include "loader/parser/directive_parser.h"
#include "loader/parser/gltf_decl.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace strobe {
namespace {

constexpr size_t kMaxIncludeDepth = 64;
constexpr size_t kMaxBlockDepth = 4096;

std::filesystem::path canonicalPath(const std::filesystem::path& path) {
    std::error_code ignored; // a text in memory has a name, but no file
    const auto result = std::filesystem::weakly_canonical(path, ignored);
    return ignored ? path : result;
}

/// Returns the source with the commas that some exporters write between numbers, and that pbrt ignores,
/// replaced by blanks. Offsets do not change.
std::shared_ptr<const Source> withoutCommas(std::shared_ptr<const Source> source, Diagnostics& diagnostics) {
    const std::string_view text = source->text;
    if (text.find(',') == std::string_view::npos)
        return source;
    std::shared_ptr<std::string> copy;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '#') {
            i = std::min(text.find('\n', i), text.size());
        } else if (text[i] == '"') {
            while (++i < text.size() && text[i] != '"' && text[i] != '\n')
                i += text[i] == '\\';
        } else if (text[i] == ',') {
            if (!copy) {
                copy = std::make_shared<std::string>(text);
                diagnostics.noteOnce("commas", {source, i}, "commas between numbers are ignored");
            }
            (*copy)[i] = ' ';
        }
    }
    if (!copy)
        return source;
    return std::make_shared<Source>(source->path, *copy, copy, source->mainDirectory, source->policy);
}

void interpolateWorldToObject(KeyedTransform& t) {
    if (!t.isStatic())
        t = KeyedTransform(t.times(), t.keys(), MotionConvention::WorldToObject);
}

void interpolateWorldToObject(ObjectDecl& object) {
    for (ShapeDecl& shape : object.shapes)
        interpolateWorldToObject(shape.toParent);
    for (InstanceDecl& instance : object.instances) {
        TransformChain path;
        for (KeyedTransform t : instance.toParent.chain()) {
            interpolateWorldToObject(t);
            path.append(std::move(t));
        }
        instance.toParent = std::move(path);
    }
}

/// Gives all animated transforms but the camera's pbrt-v2's interpolation. Done last, since the conventions
/// are known only after the whole text is read.
void interpolateWorldToObject(SceneDescription& desc) {
    interpolateWorldToObject(desc.world);
    for (ObjectDecl& object : desc.objects)
        interpolateWorldToObject(object);
    for (LightDecl& light : desc.lights)
        interpolateWorldToObject(light.toWorld);
    for (TextureDecl& texture : desc.textures)
        interpolateWorldToObject(texture.toWorld);
}

} // namespace

bool isPbrtName(const std::filesystem::path& name) {
    return (name.extension() == ".gz" ? name.stem() : name).extension() == ".pbrt";
}

std::string inQuotes(std::string_view name) { return describe({TokenKind::String, 0, name}); }

std::string suggestion(std::string_view name, const std::vector<std::string>& names) {
    const std::string nearest = nearestName(name, names);
    return nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
}

const std::map<std::string, DirectiveParser::Directive, std::less<>>& DirectiveParser::directives() {
    using P = DirectiveParser;
    constexpr Section any = Section::Any;
    constexpr Section options = Section::Options;
    constexpr Section world = Section::World;
    static const std::map<std::string, Directive, std::less<>> table{
        {"Identity", {any, &P::identity}},
        {"Translate", {any, &P::translate}},
        {"Scale", {any, &P::scale}},
        {"Rotate", {any, &P::rotate}},
        {"LookAt", {any, &P::lookAtDirective}},
        {"Transform", {any, &P::transform}},
        {"ConcatTransform", {any, &P::concatTransform}},
        {"CoordinateSystem", {any, &P::coordinateSystem}},
        {"CoordSysTransform", {any, &P::coordSysTransform}},
        {"TransformTimes", {options, &P::transformTimes}},
        {"ActiveTransform", {any, &P::activeTransform}},
        {"TransformBegin", {any, &P::beginBlock}},
        {"TransformEnd", {any, &P::endBlock}},
        {"AttributeBegin", {world, &P::beginBlock}},
        {"AttributeEnd", {world, &P::endBlock}},
        {"ObjectBegin", {world, &P::objectBegin}},
        {"ObjectEnd", {world, &P::objectEnd}},
        {"ObjectInstance", {world, &P::objectInstance}},
        {"Include", {any, &P::include}},
        {"Import", {any, &P::include}},
        {"WorldBegin", {options, &P::worldBegin}},
        {"WorldEnd", {world, &P::worldEnd}},
        {"Camera", {options, &P::camera}},
        {"Film", {options, &P::film}},
        {"Sampler", {options, &P::sampler}},
        {"PixelFilter", {options, &P::pixelFilter}},
        {"Accelerator", {options, &P::accelerator}},
        {"SurfaceIntegrator", {options, &P::integrator}},
        {"Integrator", {options, &P::integrator}},
        {"Renderer", {options, &P::ignore}},
        {"VolumeIntegrator", {options, &P::ignore}},
        {"Option", {options, &P::option}},
        {"Default", {any, &P::defaultValue}},
        {"ColorSpace", {any, &P::colorSpace}},
        {"Attribute", {any, &P::attribute}},
        {"ReverseOrientation", {world, &P::reverseOrientation}},
        {"Material", {world, &P::material}},
        {"MakeNamedMaterial", {world, &P::makeNamedMaterial}},
        {"NamedMaterial", {world, &P::namedMaterial}},
        {"Texture", {world, &P::texture}},
        {"LightSource", {world, &P::lightSource}},
        {"AreaLightSource", {world, &P::areaLightSource}},
        {"Shape", {world, &P::shape}},
        {"Volume", {world, &P::ignore}},
        {"MakeNamedMedium", {any, &P::makeNamedMedium}},
        {"MediumInterface", {any, &P::mediumInterface}},
    };
    return table;
}

DirectiveParser::DirectiveParser(const std::set<std::string>& sharingNames, Diagnostics& diagnostics,
                                 bool isStrict, std::shared_ptr<const ResourcePolicy> policy,
                                 SceneValues values)
    : m_sharingNames(sharingNames), m_diagnostics(diagnostics), m_policy(std::move(policy)),
      m_values(std::move(values)), m_isStrict(isStrict) {
    m_desc.materials.push_back({"", {"matte", ParamSet(), {}}});
    m_desc.world.name = "world";
}

void DirectiveParser::parse(std::shared_ptr<const Source> source) {
    m_end = {source, source->text.size()};
    parseSource(std::move(source));
}

void DirectiveParser::parseGltf(const std::filesystem::path& path) {
    const auto source = makeSource("", path, m_policy);
    if (!m_worldBegin)
        worldBegin({"WorldBegin", {source, 0}});
    addGltf(readGltf(path, {}, m_policy));
}

void DirectiveParser::parseSource(std::shared_ptr<const Source> source) {
    if (!m_isStrict)
        source = withoutCommas(std::move(source), m_diagnostics);
    if (isLfsPointer(source->text))
        throw Error({source, 0}, fmt::format("\"{}\" {}", source->path.string(), kLfsPointerMessage));
    m_files.push_back(canonicalPath(source->path));
    m_desc.sources.push_back(source);
    Lexer lexer(std::move(source), &m_values);
    Lexer* const outer = std::exchange(m_lexer, &lexer);
    if (outer)
        m_outerLexers.push_back(outer);
    for (Token token = lexer.next(); token.kind != TokenKind::End; token = lexer.next()) {
        if (m_worldEnd && !m_isStrict) { // pbrt renders the scenes of a file one after another
            m_diagnostics.warnOnce("after WorldEnd", lexer.at(token.offset),
                                   "all after WorldEnd is ignored: a run renders one scene");
            break;
        }
        dispatch(token);
    }
    m_lexer = outer;
    if (outer)
        m_outerLexers.pop_back();
    m_files.pop_back();
}

void DirectiveParser::dispatch(const Token& word) {
    if (word.kind != TokenKind::Word)
        throw Error(m_lexer->at(word.offset), fmt::format("expected a directive, found {}", describe(word)));
    const auto found = directives().find(word.text);
    if (found == directives().end())
        failUnknown(word);
    const Call call{found->first, m_lexer->at(word.offset)};
    checkSection(found->second, call);
    (this->*found->second.handle)(call);
}

void DirectiveParser::failUnknown(const Token& word) const {
    throw Error(m_lexer->at(word.offset), fmt::format("unknown directive {}{}", describe(word),
                                                      suggestion(word.text, namesOf(directives()))));
}

void DirectiveParser::checkSection(const Directive& directive, const Call& call) const {
    if (m_worldEnd)
        throw Error(call.where, fmt::format("{} after WorldEnd ({}); a run renders one scene", call.name,
                                            m_worldEnd.toString()));
    if (call.name == "WorldBegin" && m_worldBegin)
        throw Error(call.where,
                    fmt::format("a second WorldBegin; the first is at {}", m_worldBegin.toString()));
    if (directive.section == Section::Options && m_worldBegin)
        throw Error(call.where,
                    fmt::format("{} must come before WorldBegin ({})", call.name, m_worldBegin.toString()));
    if (directive.section == Section::World && !m_worldBegin)
        throw Error(call.where, fmt::format("{} must come after WorldBegin", call.name));
}

void DirectiveParser::include(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of a file");
    const std::filesystem::path path = resolveFile(name, where);
    if (gltf::isGltfName(path)) {
        if (!m_worldBegin)
            throw Error(where, "a glTF file must be included after WorldBegin");
        return addGltf(readGltf(path, where, m_policy));
    }
    if (std::find(m_files.begin(), m_files.end(), canonicalPath(path)) != m_files.end())
        throw Error(where, fmt::format("\"{}\" includes itself", path.string()));
    if (m_files.size() > kMaxIncludeDepth)
        throw Error(where, fmt::format("Include is nested more than {} deep", kMaxIncludeDepth));
    m_looksLikeV4 |= call.name == "Import";
    parseSource(readSource(path, m_lexer->source().mainDirectory, where, m_policy));
}

void DirectiveParser::worldBegin(const Call& call) {
    checkAllClosed();
    m_worldBegin = call.where;
    m_desc.world.where = call.where;
    m_state.transform = CurrentTransform(m_desc.keyTimes.size());
    m_coordinateSystems["world"] = m_state.transform.keys();
}

void DirectiveParser::worldEnd(const Call& call) {
    checkAllClosed();
    m_worldEnd = call.where;
}

void DirectiveParser::checkAllClosed() const {
    if (!m_openBlocks.empty())
        throw Error(m_openBlocks.back().where, fmt::format("{} is never closed", m_openBlocks.back().name));
}

void DirectiveParser::beginBlock(const Call& call) {
    if (m_openBlocks.size() >= kMaxBlockDepth)
        throw Error(call.where, fmt::format("blocks are nested more than {} deep", kMaxBlockDepth));
    m_openBlocks.push_back({call.name, call.where, m_state});
}

/// Makes the innermost open block one of `opener`, for files that end objects and attributes in the wrong
/// order: pbrt has one stack for both, so that only the names of the open blocks matter. Returns false if no
/// block of `opener` is open inside the innermost TransformBegin.
bool DirectiveParser::reorderBlocks(const std::string& opener) {
    for (auto block = m_openBlocks.rbegin(); block != m_openBlocks.rend(); ++block) {
        if (block->name == "TransformBegin")
            return false;
        if (block->name == opener) {
            std::swap(block->name, m_openBlocks.back().name);
            return true;
        }
    }
    return false;
}

const DirectiveParser::OpenBlock& DirectiveParser::closeBlock(const Call& call, const std::string& opener) {
    if (m_openBlocks.empty())
        throw Error(call.where, fmt::format("{} without {}", call.name, opener));
    const OpenBlock& open = m_openBlocks.back();
    if (open.name != opener) {
        const std::string mistake =
            fmt::format("{} does not match {} ({})", call.name, open.name, open.where.toString());
        if (m_isStrict || !reorderBlocks(opener))
            throw Error(call.where, mistake);
        m_diagnostics.warnOnce("mismatched blocks", call.where,
                               mistake + "; the state that was saved last is restored, as in pbrt");
    }
    return open;
}

void DirectiveParser::endBlock(const Call& call) {
    const bool transformOnly = call.name == "TransformEnd";
    const OpenBlock& open = closeBlock(call, transformOnly ? "TransformBegin" : "AttributeBegin");
    if (transformOnly) {
        m_state.transform = open.saved.transform;
        m_state.transformError = open.saved.transformError;
    } else {
        m_state = open.saved;
    }
    m_openBlocks.pop_back();
}

void DirectiveParser::objectBegin(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the object's name");
    if (m_object >= 0)
        throw Error(call.where,
                    fmt::format("ObjectBegin inside object {} ({})", inQuotes(m_desc.objects[m_object].name),
                                m_desc.objects[m_object].where.toString()));
    if (const auto old = m_objects.find(name); old != m_objects.end())
        m_diagnostics.warn(where, fmt::format("object {} replaces the one at {}", inQuotes(name),
                                              m_desc.objects[old->second].where.toString()));
    beginBlock(call);
    m_object = static_cast<int>(m_desc.objects.size());
    m_desc.objects.push_back({name, call.where, {}, {}});
}

void DirectiveParser::objectEnd(const Call& call) {
    m_state = closeBlock(call, "ObjectBegin").saved;
    m_openBlocks.pop_back();
    m_objects[m_desc.objects[m_object].name] = m_object;
    m_object = -1;
}

/// Whether a .pbrt file that is not of v2 is of v3, whose film is called "image".
bool DirectiveParser::isVersion3() const {
    return !m_isStrict && m_desc.film && m_desc.film->name == "image";
}

SceneDescription DirectiveParser::finish() {
    checkAllClosed();
    if (!m_worldBegin)
        throw Error(m_end, "the scene has no WorldBegin");
    warnOfMiddleKeys();
    m_desc.values = m_values.used();
    m_desc.strictParameters = m_isStrict;
    m_desc.conventions = m_requestedConventions ? *m_requestedConventions
                         : m_isStrict           ? Conventions::PbrtV4
                         : m_looksLikeV2        ? Conventions::PbrtV2
                         : m_looksLikeV4        ? Conventions::PbrtV4
                                                : Conventions::PbrtV2;
    m_desc.pbrtVersion = m_desc.conventions == Conventions::PbrtV2 ? 2 : isVersion3() ? 3 : 4;
    if (m_desc.conventions == Conventions::PbrtV2)
        interpolateWorldToObject(m_desc);
    return std::move(m_desc);
}

SceneDescription parseFiles(const std::vector<std::filesystem::path>& files,
                            const std::set<std::string>& sharingNames, Diagnostics& diagnostics,
                            std::shared_ptr<const ResourcePolicy> policy,
                            const std::vector<std::string>& defines) {
    if (files.empty())
        throw Error("no scene file is given", ErrorKind::Usage);
    DirectiveParser parser(sharingNames, diagnostics, !isPbrtName(files.front()), policy,
                           SceneValues(defines));
    for (const std::filesystem::path& file : files) {
        if (gltf::isGltfName(file))
            parser.parseGltf(file);
        else
            parser.parse(readSource(file, file.parent_path(), {}, policy));
    }
    return parser.finish();
}

SceneDescription parseText(const std::string& text, const std::filesystem::path& name,
                           const std::set<std::string>& sharingNames, Diagnostics& diagnostics,
                           std::shared_ptr<const ResourcePolicy> policy) {
    DirectiveParser parser(sharingNames, diagnostics, !isPbrtName(name), policy, SceneValues());
    parser.parse(makeSource(text, name, policy));
    return parser.finish();
}

} // namespace strobe
