// Creates plugins from statements.
#pragma once

#include "core/image/image.h"
#include "core/util/diagnostics.h"
#include "loader/build/plugin_tables.h"
#include "loader/compat/pbrt_compat.h"
#include "loader/parser/description.h"

namespace strobe {

/// Looks up the plugin that a statement names, creates it and reports unread parameters. The names of other
/// renderers' plugins are replaced by plugins of strobe or by compatibility plugins, with one warning for
/// each kind and name unless the replacement is exact. Throws located Errors.
class PluginFactory {
  public:
    /// `textureMegabytes`: see TextureCache.
    PluginFactory(const SceneDescription& description, std::shared_ptr<const ColorConfig> color,
                  int textureMegabytes, Diagnostics& diagnostics);
    /// A copy that sends its warnings to `diagnostics`.
    PluginFactory(const PluginFactory& other, Diagnostics& diagnostics);

    /// Creates the plugin of a statement; returns an empty product if the statement is skipped. `kind`: the
    /// noun of diagnostics. May change the statement's name and parameters to those of the replacement.
    template <class Product, class... Args>
    Product make(const std::vector<Plugin<Product, Args...>>& table, Statement& statement, const char* kind,
                 const std::type_identity_t<Args>&... args) {
        return make(table, {}, statement, kind, args...);
    }
    /// As above; names that are not in `table` are looked up in `compat` first. Of a name in both, isCompat
    /// selects the plugin.
    template <class Product, class... Args>
    Product make(const std::vector<Plugin<Product, Args...>>& table,
                 const std::vector<CompatPlugin<Plugin<Product, Args...>>>& compat, Statement& statement,
                 const char* kind, const std::type_identity_t<Args>&... args) {
        const auto it = std::find_if(compat.begin(), compat.end(), [&](const auto& plugin) {
            return plugin.row.name == statement.name &&
                   (!contains(table, statement.name) || isCompat(statement));
        });
        if (it != compat.end()) {
            warnUnsupported(statement, kind, it->replacement);
            return create(it->row, statement, args...);
        }
        resolveName(statement, kind, table);
        if (isSkipped(statement))
            return Product{};
        return create(findPlugin(table, statement.name, kind, statement.where), statement, args...);
    }

    /// Replaces the name if it is an alias. In a lenient file, also replaces an unknown name by the default
    /// plugin of its kind, or marks the statement as skipped.
    template <class Row>
    void resolveName(Statement& statement, const char* kind, const std::vector<Row>& table) {
        if (!resolveAlias(statement, kind) && !m_strict && statement.where &&
            !contains(table, statement.name))
            replaceUnknown(statement, kind);
    }

    TextureTable& textures() { return *m_textures; }
    /// Gives the statement's parameters access to the textures.
    void bindTextures(Statement& statement) { statement.params.bindTextures(m_textures); }
    const BuildContext& context() const { return m_context; }
    /// Warns, once for each kind and name, `KIND "NAME" is not supported; REPLACEMENT`. No warning if
    /// `replacement` is empty.
    void warnUnsupported(const Statement& statement, const char* kind, const std::string& replacement);

  private:
    template <class Row, class... Args>
    auto create(const Row& row, Statement& statement, const Args&... args) {
        bindTextures(statement);
        statement.params.checkPhysical(row.params, m_strict, m_context.diagnostics);
        auto product = row.create(statement.params, m_context, args...);
        statement.params.reportUnused(row.params, m_strict, m_context.diagnostics);
        return product;
    }
    template <class Row>
    static bool contains(const std::vector<Row>& table, const std::string& name) {
        return std::any_of(table.begin(), table.end(), [&](const Row& row) { return row.name == name; });
    }
    /// Returns whether a name that both strobe and another renderer use means the other renderer's plugin.
    bool isCompat(const Statement& statement) const;
    bool resolveAlias(Statement& statement, const char* kind);
    void replaceUnknown(Statement& statement, const char* kind);
    static bool isSkipped(const Statement& statement);

    bool m_strict;
    BuildContext m_context;
    std::shared_ptr<TextureTable> m_textures;
};

} // namespace strobe
