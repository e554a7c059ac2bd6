// Makes plugins from statements.
#pragma once

#include "core/image/image.h"
#include "loader/build/plugin_tables.h"
#include "loader/compat/pbrt_compat.h"
#include "loader/parser/description.h"

namespace strobe {

/// Looks names up, creates, reports what was not read. Names of other renderers' plugins become ours, or a
/// foreign row of the same kind; the first time that this changes something, a warning says so.
class PluginFactory {
  public:
    PluginFactory(const SceneDescription& description, std::shared_ptr<const ColorConfig> color,
                  Diagnostics& messages);
    /// The same maker, which tells its warnings to another.
    PluginFactory(const PluginFactory& other, Diagnostics& messages);

    /// `foreign`: rows for names that are none of ours; their names may also be ours, for pbrt-v3 files.
    template <class Product, class... Args>
    Product make(const std::vector<Plugin<Product, Args...>>& table, Statement& statement, const char* kind,
                 const std::type_identity_t<Args>&... args) {
        return make(table, {}, statement, kind, args...);
    }
    template <class Product, class... Args>
    Product make(const std::vector<Plugin<Product, Args...>>& table,
                 const std::vector<CompatPlugin<Plugin<Product, Args...>>>& foreign, Statement& statement,
                 const char* kind, const std::type_identity_t<Args>&... args) {
        const auto it = std::find_if(foreign.begin(), foreign.end(), [&](const auto& f) {
            return f.row.name == statement.name && (!isOneOf(table, statement.name) || isCompat(statement));
        });
        if (it != foreign.end()) {
            note(statement, kind, it->becomes);
            return create(it->row, statement, args...);
        }
        resolveName(statement, kind, table);
        if (isLeftOut(statement))
            return Product{};
        return create(findPlugin(table, statement.name, kind, statement.where), statement, args...);
    }

    /// Puts our name in the place of another renderer's, if there is one that takes the same parameters. In a
    /// lenient file, names that nobody knows are replaced or left out.
    template <class Row>
    void resolveName(Statement& statement, const char* kind, const std::vector<Row>& table) {
        if (!resolveAlias(statement, kind) && !m_strict && statement.where && !isOneOf(table, statement.name))
            replaceUnknown(statement, kind);
    }

    TextureTable& textures() { return *m_textures; }
    /// So that textures can be read.
    void bind(Statement& statement) { statement.params.bindTextures(m_textures); }
    const BuildContext& context() const { return m_context; }
    /// Warns, once for each kind and name, of what a statement becomes; says nothing when `becomes` is empty.
    void note(const Statement& statement, const char* kind, const std::string& becomes);

  private:
    template <class Row, class... Args>
    auto create(const Row& row, Statement& statement, const Args&... args) {
        bind(statement);
        auto product = row.create(statement.params, m_context, args...);
        statement.params.reportUnused(row.params, m_strict, m_context.diagnostics);
        return product;
    }
    template <class Row>
    static bool isOneOf(const std::vector<Row>& table, const std::string& name) {
        return std::any_of(table.begin(), table.end(), [&](const Row& row) { return row.name == name; });
    }
    /// Of a name that is ours as well: whether the other renderer's plugin is meant.
    bool isCompat(const Statement& statement) const;
    bool resolveAlias(Statement& statement, const char* kind);
    void replaceUnknown(Statement& statement, const char* kind);
    static bool isLeftOut(const Statement& statement);

    bool m_strict;
    BuildContext m_context;
    std::shared_ptr<TextureTable> m_textures;
};

} // namespace strobe
