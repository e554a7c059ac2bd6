// Directives that change the current transform, and the arguments of directives.
#include "loader/parser/directive_parser.h"

#include <fmt/format.h>

namespace strobe {
namespace {

constexpr size_t kMaxTimes = 4096; // each transform has a matrix for each

} // namespace

void DirectiveParser::failFound(const Call& call, const std::string& needed) {
    const Token found = m_lexer->next();
    throw Error(m_lexer->at(found.offset),
                fmt::format("{} needs {}, found {}", call.name, needed, describe(found)));
}

std::string DirectiveParser::readString(const Call& call, const char* noun) {
    if (m_lexer->peek() != TokenKind::String)
        failFound(call, fmt::format("{} in quotes", noun));
    return m_lexer->unescape(m_lexer->next());
}

double DirectiveParser::readNumber(const Call& call) {
    if (m_lexer->peek() != TokenKind::Number)
        failFound(call, "a number");
    return m_lexer->readDouble();
}

template <size_t n>
std::array<double, n> DirectiveParser::readNumbers(const Call& call, bool allowBrackets) {
    const bool bracket = allowBrackets && m_lexer->peek() == TokenKind::Open;
    if (bracket)
        m_lexer->next();
    std::array<double, n> numbers;
    for (double& number : numbers)
        number = readNumber(call);
    if (bracket && m_lexer->peek() != TokenKind::Close)
        failFound(call, fmt::format("{} numbers and ']'", n));
    if (bracket)
        m_lexer->next();
    return numbers;
}

/// Calls `change`. In a lenient file, keeps its Error for the first use of the transform: files of pbrt have
/// transforms without an inverse where no shape stands.
template <class F>
void DirectiveParser::changeTransform(const F& change) {
    try {
        change();
    } catch (const Error& e) {
        if (m_isStrict)
            throw;
        m_state.transformError = std::make_shared<const Error>(e);
    }
}

void DirectiveParser::requireTransform() const {
    if (m_state.transformError)
        throw Error(*m_state.transformError);
}

void DirectiveParser::identity(const Call&) {
    m_state.transform.set(M44d());
    m_state.transformError.reset();
}

void DirectiveParser::translate(const Call& call) {
    const auto [x, y, z] = readNumbers<3>(call);
    const M44d t = translation(x, y, z);
    changeTransform([&] { m_state.transform.apply(t, call.where); });
}

void DirectiveParser::scale(const Call& call) {
    const auto [x, y, z] = readNumbers<3>(call);
    const std::array<double, 3> factors{x, y, z};
    changeTransform([&] {
        m_state.transform.apply(scaling(factors[0], factors[1], factors[2], call.where), call.where);
    });
}

void DirectiveParser::rotate(const Call& call) {
    const auto [degrees, x, y, z] = readNumbers<4>(call);
    const CurrentTransform& current = m_state.transform;
    if (std::abs(degrees) >= 360 && current.active() != CurrentTransform::kAll && current.count() == 2)
        m_diagnostics.warn(call.where,
                           "between two keys, rotations take the shortest way, at most 180 degrees: use "
                           "TransformTimes with more keys");
    m_state.transform.apply(rotation(degrees, x, y, z, call.where), call.where);
}

void DirectiveParser::lookAtDirective(const Call& call) {
    const auto numbers = readNumbers<9>(call);
    changeTransform([&] { m_state.transform.apply(lookAt(numbers, call.where), call.where); });
}

void DirectiveParser::transform(const Call& call) {
    const auto numbers = readNumbers<16>(call, true);
    m_state.transformError.reset();
    changeTransform([&] { m_state.transform.set(matrixFromNumbers(numbers, call.where)); });
}

void DirectiveParser::concatTransform(const Call& call) {
    const auto numbers = readNumbers<16>(call, true);
    changeTransform([&] { m_state.transform.apply(matrixFromNumbers(numbers, call.where), call.where); });
}

void DirectiveParser::coordinateSystem(const Call& call) {
    const std::string name = readString(call, "a name");
    requireTransform();
    m_coordinateSystems[name] = m_state.transform.keys();
}

void DirectiveParser::coordSysTransform(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of a coordinate system");
    const auto found = m_coordinateSystems.find(name);
    if (found == m_coordinateSystems.end())
        throw Error(where, fmt::format("unknown coordinate system {}{}", inQuotes(name),
                                       suggestion(name, namesOf(m_coordinateSystems))));
    m_state.transform.setKeys(found->second); // of all keys, active or not, as in pbrt
    m_state.transformError.reset();
}

std::vector<float> DirectiveParser::readTimes(const Call& call) {
    const bool bracket = m_lexer->peek() == TokenKind::Open;
    if (bracket)
        m_lexer->next();
    std::vector<float> times;
    while (m_lexer->peek() == TokenKind::Number) {
        const Location where = m_lexer->here();
        times.push_back(m_lexer->readFloat());
        if (times.size() > 1 && !(times[times.size() - 2] < times.back()))
            throw Error(where, "the numbers of TransformTimes must ascend");
    }
    if (bracket && m_lexer->peek() != TokenKind::Close)
        failFound(call, "numbers and ']'");
    if (bracket)
        m_lexer->next();
    if (times.size() > kMaxTimes)
        throw Error(call.where, fmt::format("TransformTimes has more than {} numbers", kMaxTimes));
    if (times.size() < 2)
        throw Error(call.where,
                    fmt::format("TransformTimes needs at least two numbers, got {}", times.size()));
    return times;
}

bool DirectiveParser::hasAnimatedTransform() const {
    const auto isAnimated = [](const std::vector<M44d>& keys) {
        return std::any_of(keys.begin(), keys.end(), [&](const M44d& key) { return key != keys.front(); });
    };
    if (isAnimated(m_state.transform.keys()))
        return true;
    for (const OpenBlock& block : m_openBlocks)
        if (isAnimated(block.saved.transform.keys()))
            return true;
    return std::any_of(m_coordinateSystems.begin(), m_coordinateSystems.end(),
                       [&](const auto& entry) { return isAnimated(entry.second); });
}

void DirectiveParser::transformTimes(const Call& call) {
    std::vector<float> times = readTimes(call);
    if (hasAnimatedTransform())
        throw Error(call.where, "TransformTimes must come before animated transforms");
    if (m_state.transform.active() >= static_cast<int>(times.size()))
        throw Error(call.where, "the key chosen by ActiveTransform does not exist in these TransformTimes");
    m_state.transform.setCount(times.size());
    for (OpenBlock& block : m_openBlocks)
        block.saved.transform.setCount(times.size());
    for (auto& [name, keys] : m_coordinateSystems)
        keys.assign(times.size(), M44d(keys.front()));
    m_desc.keyTimes = std::move(times);
}

void DirectiveParser::activeTransform(const Call& call) {
    const Location where = m_lexer->here();
    const int last = static_cast<int>(m_state.transform.count()) - 1;
    if (m_lexer->peek() == TokenKind::Number) {
        const int key = m_lexer->readInt();
        if (key < 0 || key > last)
            throw Error(where,
                        fmt::format("there is no key {}; the keys of TransformTimes are 0 to {}", key, last));
        m_choosesKeysByNumber = true;
        return m_state.transform.setActive(key);
    }
    const std::string_view word = m_lexer->peek() == TokenKind::Word ? Lexer(*m_lexer).next().text : "";
    if (word == "All")
        m_state.transform.setActive(CurrentTransform::kAll);
    else if (word == "StartTime")
        m_state.transform.setActive(0);
    else if (word == "EndTime")
        m_state.transform.setActive(last);
    else
        failFound(call, "StartTime, EndTime, All or the index of a key");
    if (word != "All" && last > 1 && !m_endKeysChosen)
        m_endKeysChosen = where;
    m_lexer->next();
}

KeyedTransform DirectiveParser::keyed(const Location& where) {
    requireTransform();
    const std::vector<M44d>& keys = m_state.transform.keys();
    const auto mirrors = [](const M44d& key) { return key.determinant() < 0; };
    if (std::any_of(keys.begin(), keys.end(),
                    [&](const M44d& key) { return mirrors(key) != mirrors(keys.front()); }))
        reportMistake(where, "a key of the transform mirrors, and another does not",
                      "between them the object has no volume");
    return toKeyed(keys, m_desc.keyTimes);
}

void DirectiveParser::warnOfMiddleKeys() {
    if (m_endKeysChosen && !m_choosesKeysByNumber)
        m_diagnostics.warn(m_endKeysChosen,
                           fmt::format("StartTime and EndTime change the first and the last of {} keys only; "
                                       "choose those between by number: ActiveTransform 1",
                                       m_desc.keyTimes.size()));
}

} // namespace strobe
