// The parser's frame: files, blocks and the table of directives.
#include "loader/parser/parser.h"

#include "core/util/nearest_name.h"
#include "loader/build/gltf_scene.h"
#include "loader/parser/parser_impl.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace strobe {
namespace {

constexpr size_t kMaxIncludeDepth = 64, kMaxBlockDepth = 4096;

std::filesystem::path canonicalPath(const std::filesystem::path& path) {
    std::error_code ignored; // a text in memory has a name but no file
    const auto result = std::filesystem::weakly_canonical(path, ignored);
    return ignored ? path : result;
}

/// The source without the commas that some exporters put between numbers: pbrt reads over them. Offsets stay
/// what they are.
std::shared_ptr<const Source> withoutCommas(std::shared_ptr<const Source> source, Diagnostics& messages) {
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
                messages.warnOnce("commas", {source, i}, "commas between numbers are read as blanks");
            }
            (*copy)[i] = ' ';
        }
    }
    if (!copy)
        return source;
    return std::make_shared<Source>(source->path, *copy, copy, source->mainDirectory, source->policy);
}

void followPbrtV2(KeyedTransform& t) {
    if (!t.isStatic())
        t = KeyedTransform(t.times(), t.keys(), MotionConvention::WorldToObject);
}

/// Which end of an animated transform is interpolated is known only when the whole text is.
void followPbrtV2(SceneDescription& desc) {
    const auto followObject = [](ObjectDecl& object) {
        for (ShapeDecl& shape : object.shapes)
            followPbrtV2(shape.toParent);
        for (InstanceDecl& instance : object.instances) {
            TransformChain path;
            for (KeyedTransform t : instance.toParent.chain()) {
                followPbrtV2(t);
                path.append(std::move(t));
            }
            instance.toParent = std::move(path);
        }
    };
    followObject(desc.world);
    for (ObjectDecl& object : desc.objects)
        followObject(object);
    for (LightDecl& light : desc.lights)
        followPbrtV2(light.toWorld);
    for (TextureDecl& texture : desc.textures)
        followPbrtV2(texture.toWorld);
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

const std::map<std::string, Parser::Directive, std::less<>>& Parser::directives() {
    using P = Parser;
    constexpr Block any = Block::Any, options = Block::Options, world = Block::World;
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
        {"Renderer", {options, &P::skip}},
        {"VolumeIntegrator", {options, &P::skip}},
        {"Option", {options, &P::option}},
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
        {"Volume", {world, &P::skip}},
        {"MakeNamedMedium", {any, &P::skip}},
        {"MediumInterface", {any, &P::skipMediumInterface}},
    };
    return table;
}

Parser::Parser(const std::set<std::string>& sharingNames, Diagnostics& messages, bool isStrict,
               std::shared_ptr<const ResourcePolicy> guard)
    : m_sharingNames(sharingNames), m_messages(messages), m_guard(std::move(guard)), m_isStrict(isStrict) {
    m_desc.materials.push_back({"", {"matte", ParamSet(), {}}});
    m_desc.world.name = "world";
}

void Parser::parse(std::shared_ptr<const Source> source) {
    m_end = {source, source->text.size()};
    parseSource(std::move(source));
}

void Parser::parseGltf(const std::filesystem::path& path) {
    const auto source = makeSource("", path, m_guard);
    if (!m_worldBegin)
        worldBegin({"WorldBegin", {source, 0}});
    addGltf(readGltf(path, {}, m_guard));
}

void Parser::parseSource(std::shared_ptr<const Source> source) {
    if (!m_isStrict)
        source = withoutCommas(std::move(source), m_messages);
    m_files.push_back(canonicalPath(source->path));
    m_desc.sources.push_back(source);
    Lexer lexer(std::move(source));
    Lexer* const outer = std::exchange(m_lexer, &lexer);
    for (Token token = lexer.next(); token.kind != TokenKind::End; token = lexer.next())
        dispatch(token);
    m_lexer = outer; // not restored after an error: the parser is of no use then
    m_files.pop_back();
}

void Parser::dispatch(const Token& word) {
    if (word.kind != TokenKind::Word)
        throw Error(m_lexer->at(word.offset), fmt::format("expected a directive, found {}", describe(word)));
    const auto found = directives().find(word.text);
    if (found == directives().end())
        failUnknown(word);
    const Call call{found->first, m_lexer->at(word.offset)};
    checkBlock(found->second, call);
    (this->*found->second.handle)(call);
}

void Parser::failUnknown(const Token& word) const {
    throw Error(m_lexer->at(word.offset), fmt::format("unknown directive {}{}", describe(word),
                                                      suggestion(word.text, namesOf(directives()))));
}

void Parser::checkBlock(const Directive& directive, const Call& call) const {
    if (m_worldEnd)
        throw Error(call.where, fmt::format("{} after WorldEnd ({}): there is one scene to a run", call.name,
                                            m_worldEnd.toString()));
    if (directive.block == Block::Options && m_worldBegin)
        throw Error(call.where,
                    fmt::format("{} must come before WorldBegin ({})", call.name, m_worldBegin.toString()));
    if (directive.block == Block::World && !m_worldBegin)
        throw Error(call.where, fmt::format("{} must come after WorldBegin", call.name));
}

void Parser::include(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of a file");
    const std::filesystem::path path = resolveFile(name, where);
    if (gltf::isGltfName(path)) {
        if (!m_worldBegin)
            throw Error(where, "a glTF file is part of the world: Include it after WorldBegin");
        return addGltf(readGltf(path, where, m_guard));
    }
    if (std::find(m_files.begin(), m_files.end(), canonicalPath(path)) != m_files.end())
        throw Error(where, fmt::format("\"{}\" includes itself", path.string()));
    if (m_files.size() > kMaxIncludeDepth)
        throw Error(where, fmt::format("files include one another more than {} deep", kMaxIncludeDepth));
    m_looksLikeV4 |= call.name == "Import";
    parseSource(readSource(path, m_lexer->source().mainDirectory, where, m_guard));
}

void Parser::worldBegin(const Call& call) {
    checkAllClosed();
    m_worldBegin = call.where;
    m_desc.world.where = call.where;
    m_state.transform = CurrentTransform(m_desc.keyTimes.size());
    m_coordinateSystems["world"] = m_state.transform.keys();
}

void Parser::worldEnd(const Call& call) {
    checkAllClosed();
    m_worldEnd = call.where;
}

void Parser::checkAllClosed() const {
    if (!m_open.empty())
        throw Error(m_open.back().where, fmt::format("{} is never closed", m_open.back().name));
}

void Parser::beginBlock(const Call& call) {
    if (m_open.size() >= kMaxBlockDepth)
        throw Error(call.where, fmt::format("blocks stand in one another more than {} deep", kMaxBlockDepth));
    m_open.push_back({call.name, call.where, m_state});
}

/// Objects and attributes may end in the wrong order: as pbrt has one stack for both, this changes only what
/// the blocks are called. False if `opener` is none of these.
bool Parser::untangle(const std::string& opener) {
    for (auto open = m_open.rbegin(); open != m_open.rend() && open->name != "TransformBegin"; ++open)
        if (open->name == opener) {
            std::swap(open->name, m_open.back().name);
            return true;
        }
    return false;
}

const Parser::Open& Parser::closeBlock(const Call& call, const std::string& opener) {
    if (m_open.empty())
        throw Error(call.where, fmt::format("{} without {}", call.name, opener));
    const Open& open = m_open.back();
    if (open.name != opener) {
        const std::string what =
            fmt::format("{} comes before the end of {} ({})", call.name, open.name, open.where.toString());
        if (m_isStrict || !untangle(opener))
            throw Error(call.where, what);
        m_messages.warnOnce("tangled blocks", call.where, what + ": what was saved last is restored first");
    }
    return open;
}

void Parser::endBlock(const Call& call) {
    const bool transformOnly = call.name == "TransformEnd";
    const Open& open = closeBlock(call, transformOnly ? "TransformBegin" : "AttributeBegin");
    if (transformOnly)
        m_state.transform = open.saved.transform;
    else
        m_state = open.saved;
    m_open.pop_back();
}

void Parser::objectBegin(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the object's name");
    if (m_object >= 0)
        throw Error(call.where,
                    fmt::format("ObjectBegin inside object {} ({})", inQuotes(m_desc.objects[m_object].name),
                                m_desc.objects[m_object].where.toString()));
    if (const auto old = m_objects.find(name); old != m_objects.end())
        m_messages.warn(where, fmt::format("object {} replaces the one of {}", inQuotes(name),
                                           m_desc.objects[old->second].where.toString()));
    beginBlock(call);
    m_object = static_cast<int>(m_desc.objects.size());
    m_desc.objects.push_back({name, call.where, {}, {}});
}

void Parser::objectEnd(const Call& call) {
    m_state = closeBlock(call, "ObjectBegin").saved;
    m_open.pop_back();
    m_objects[m_desc.objects[m_object].name] = m_object;
    m_object = -1;
}

SceneDescription Parser::finish() {
    checkAllClosed();
    if (!m_worldBegin)
        throw Error(m_end, "the scene has no WorldBegin");
    m_desc.strictParameters = m_isStrict;
    m_desc.conventions = m_saidConventions             ? *m_saidConventions
                         : m_isStrict || m_looksLikeV4 ? Conventions::PbrtV4
                                                       : Conventions::PbrtV2;
    if (m_desc.conventions == Conventions::PbrtV2)
        followPbrtV2(m_desc);
    return std::move(m_desc);
}

SceneDescription parseFiles(const std::vector<std::filesystem::path>& files,
                            const std::set<std::string>& sharingNames, Diagnostics& messages,
                            std::shared_ptr<const ResourcePolicy> guard) {
    if (files.empty())
        throw Error("no scene file is given", ErrorKind::Usage);
    Parser parser(sharingNames, messages, !isPbrtName(files.front()), guard);
    for (const std::filesystem::path& file : files) {
        if (gltf::isGltfName(file))
            parser.parseGltf(file);
        else
            parser.parse(readSource(file, file.parent_path(), {}, guard));
    }
    return parser.finish();
}

SceneDescription parseText(const std::string& text, const std::filesystem::path& name,
                           const std::set<std::string>& sharingNames, Diagnostics& messages,
                           std::shared_ptr<const ResourcePolicy> guard) {
    Parser parser(sharingNames, messages, !isPbrtName(name), guard);
    parser.parse(makeSource(text, name, guard));
    return parser.finish();
}

} // namespace strobe
