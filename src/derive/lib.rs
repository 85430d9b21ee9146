//! Derives of `FromNode` and `ToNode`, the traits of `echolume_base::tree`: types that are read from values of TOML and JSON and written as such.
//!
//! The derived code of a type is a table of its keys and places; loops over such tables are compiled once, in `echolume_base`. Serde's derives make
//! a visitor, a key type and a loop for each type. docs/experiments/compiling.md states what this saves.
//!
//! Attributes are `#[tree(...)]`, with the names and meanings that serde gives them:
//!
//! - of a struct: `default` (missing keys have the values of `Default`), `deny_unknown_fields`, `rename_all`;
//! - of an enum: `rename_all`, `deny_unknown_fields` (of what variants hold), `untagged` with `expecting`, `tag`;
//! - of a field: `default`, `default = "function"`, `rename`, `flatten` (of a type that implements `Part`, in a struct with `default`), `skip`, `skip_deserializing`, `skip_serializing_if = "function"`, `with = "module"`
//!   (with functions `from_node` and `to_node`);
//! - of a variant: `rename`, `alias`.
//!
//! The derives `Defaults`, `Name` and `All` save what would repeat a declaration: an `impl Default` by fields, the names of variants, and a list of
//! them.

#![forbid(unsafe_code)]

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};
use syn::{Attribute, Data, DataEnum, DeriveInput, Error, Field, Fields, LitStr, Path, Result, Variant};

/// Derives `FromNode`.
#[proc_macro_derive(FromNode, attributes(tree))]
pub fn from_node(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    derived(input, reading)
}

/// Derives `ToNode`.
#[proc_macro_derive(ToNode, attributes(tree))]
pub fn to_node(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    derived(input, writing)
}

/// Derives `Default` of a struct: a field has the expression of its attribute `#[value(...)]`, without one the `Default` of its type.
#[proc_macro_derive(Defaults, attributes(value))]
pub fn defaults(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    derived(input, defaulting)
}

/// Derives `fn name(self) -> &'static str` of an enum whose variants hold nothing: the variant's name in files, by `#[tree(rename_all, rename)]`.
#[proc_macro_derive(Name, attributes(tree))]
pub fn name(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    derived(input, naming)
}

/// Derives `const ALL: [Self; N]` of an enum whose variants hold nothing: all variants, in the order of their declaration.
#[proc_macro_derive(All)]
pub fn all(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    derived(input, listing)
}

fn derived(input: proc_macro::TokenStream, by: fn(&DeriveInput) -> Result<TokenStream>) -> proc_macro::TokenStream {
    syn::parse(input).and_then(|input| by(&input)).unwrap_or_else(|e| e.to_compile_error()).into()
}

/// The value of a missing key.
enum Missing {
    Needed,
    Default,
    By(Path),
}

/// The arguments of `#[tree(...)]`.
struct Arguments {
    missing: Missing,
    denies_unknown: bool,
    rename: Option<String>,
    aliases: Vec<String>,
    rename_all: Option<LitStr>,
    skip: bool,
    flatten: bool,
    skip_reading: bool,
    skip_if: Option<Path>,
    with: Option<Path>,
    untagged: bool,
    expecting: Option<String>,
    tag: Option<String>,
}

impl Arguments {
    fn of(attributes: &[Attribute]) -> Result<Arguments> {
        let mut all = Arguments {
            missing: Missing::Needed,
            denies_unknown: false,
            rename: None,
            aliases: Vec::new(),
            rename_all: None,
            skip: false,
            flatten: false,
            skip_reading: false,
            skip_if: None,
            with: None,
            untagged: false,
            expecting: None,
            tag: None,
        };
        for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("tree")) {
            attribute.parse_nested_meta(|meta| {
                let name = meta.path.require_ident()?.to_string();
                let text = || meta.value()?.parse::<LitStr>();
                match name.as_str() {
                    "default" if meta.input.peek(syn::Token![=]) => all.missing = Missing::By(text()?.parse()?),
                    "default" => all.missing = Missing::Default,
                    "deny_unknown_fields" => all.denies_unknown = true,
                    "rename" => all.rename = Some(text()?.value()),
                    "alias" => all.aliases.push(text()?.value()),
                    "rename_all" => all.rename_all = Some(text()?),
                    "skip" => all.skip = true,
                    "flatten" => all.flatten = true,
                    "skip_deserializing" => all.skip_reading = true,
                    "skip_serializing_if" => all.skip_if = Some(text()?.parse()?),
                    "with" => all.with = Some(text()?.parse()?),
                    "untagged" => all.untagged = true,
                    "expecting" => all.expecting = Some(text()?.value()),
                    "tag" => all.tag = Some(text()?.value()),
                    _ => return Err(meta.error("is no argument of `tree`")),
                }
                Ok(())
            })?;
        }
        Ok(all)
    }

    /// The name of a field or variant.
    fn name(&self, ident: &Ident, container: &Arguments) -> Result<String> {
        let own = ident.to_string();
        match (&self.rename, &container.rename_all) {
            (Some(name), _) => Ok(name.clone()),
            (None, None) => Ok(own),
            (None, Some(rule)) => match rule.value().as_str() {
                "lowercase" => Ok(own.to_lowercase()),
                "kebab-case" => Ok(kebab(&own)),
                _ => Err(Error::new(rule.span(), "is not a rule that is known here")),
            },
        }
    }
}

/// `FirstHit` and `first_hit` as `first-hit`.
fn kebab(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push('-');
        }
        words.extend(letter.to_lowercase());
    }
    words.replace('_', "-")
}

/// A named field with its arguments and its key.
struct Named<'a> {
    ident: &'a Ident,
    field: &'a Field,
    arguments: Arguments,
    key: String,
}

impl Named<'_> {
    fn has_key(&self) -> bool {
        !self.arguments.skip && !self.arguments.flatten
    }
}

/// The field, if there is one, whose keys stand beside those of the others.
fn flattened<'a>(fields: &'a [Named]) -> Option<&'a Ident> {
    fields.iter().find(|field| field.arguments.flatten).map(|field| field.ident)
}

fn named<'a>(fields: impl IntoIterator<Item = &'a Field>, container: &Arguments) -> Result<Vec<Named<'a>>> {
    let each = |field: &'a Field| {
        let ident = field.ident.as_ref().ok_or_else(|| Error::new_spanned(field, "has no name"))?;
        let arguments = Arguments::of(&field.attrs)?;
        let key = arguments.name(ident, container)?;
        Ok(Named { ident, field, arguments, key })
    };
    fields.into_iter().map(each).collect()
}

fn reading(input: &DeriveInput) -> Result<TokenStream> {
    let container = Arguments::of(&input.attrs)?;
    let body = match &input.data {
        Data::Struct(data) => {
            let fields = named(&data.fields, &container)?;
            match container.missing {
                Missing::Default => table_over_default(&fields, container.denies_unknown),
                _ => table(&fields, container.denies_unknown, &quote!(Self)),
            }
        }
        Data::Enum(data) => reading_of_enum(input, data, &container)?,
        Data::Union(_) => return Err(Error::new_spanned(&input.ident, "is a union")),
    };
    let (name, (generics, types, bounds)) = (&input.ident, input.generics.split_for_impl());
    Ok(quote! {
        #[automatically_derived]
        impl #generics ::echolume_base::tree::FromNode for #name #types #bounds {
            fn from_node(
                node: ::echolume_base::tree::Node,
            ) -> ::core::result::Result<Self, ::echolume_base::tree::NodeError> {
                #body
            }
        }
    })
}

/// Reads a table over the values of `Default`.
fn table_over_default(fields: &[Named], denies_unknown: bool) -> TokenStream {
    let part = flattened(fields);
    let slots = fields.iter().filter(|field| field.has_key()).map(|Named { ident, arguments, key, .. }| {
        let slot = match &arguments.with {
            None => quote!(&mut value.#ident),
            Some(with) => quote!(&mut ::echolume_base::tree::ReadBy(&mut value.#ident, #with::from_node)),
        };
        quote!((#key, #slot))
    });
    let read = match part {
        None => quote!(::echolume_base::tree::read_table(node, #denies_unknown, &mut [#(#slots),*])),
        Some(part) => quote! {
            ::echolume_base::tree::read_table_and(
                node,
                #denies_unknown,
                &mut [#(#slots),*],
                &mut ::echolume_base::tree::Part::slots(&mut value.#part),
            )
        },
    };
    quote! {
        let mut value = <Self as ::core::default::Default>::default();
        #read?;
        ::core::result::Result::Ok(value)
    }
}

/// Reads a table of which keys are needed. `made`: the struct or variant that is made of it.
fn table(fields: &[Named], denies_unknown: bool, made: &TokenStream) -> TokenStream {
    let is_read = |field: &&Named| !field.arguments.skip && !field.arguments.skip_reading;
    let held = |ident: &Ident| format_ident!("held_{ident}");
    let read: Vec<_> = fields.iter().filter(is_read).collect();
    let places = read.iter().map(|Named { ident, field, .. }| {
        let (held, kind) = (held(ident), &field.ty);
        quote!(let mut #held = ::echolume_base::tree::Needed::<#kind>(::core::option::Option::None);)
    });
    let slots = read.iter().map(|Named { ident, arguments, key, .. }| {
        let held = held(ident);
        let slot = match &arguments.with {
            None => quote!(&mut #held),
            Some(with) => quote! {
                &mut ::echolume_base::tree::ReadBy(&mut #held.0, |node| #with::from_node(node).map(::core::option::Option::Some))
            },
        };
        quote!((#key, #slot))
    });
    let values = fields.iter().map(|field| {
        let (ident, key, from) = (field.ident, &field.key, held(field.ident));
        let value = match &field.arguments.missing {
            _ if !is_read(&field) => quote!(::core::default::Default::default()),
            Missing::Needed => match field.arguments.with {
                None => quote!(#from.or_missing(#key, &span)?),
                Some(_) => quote!(#from.0.ok_or_else(|| ::echolume_base::tree::NodeError::missing(#key, &span))?),
            },
            Missing::Default => quote!(#from.0.unwrap_or_default()),
            Missing::By(function) => quote!(#from.0.unwrap_or_else(#function)),
        };
        quote!(#ident: #value)
    });
    quote! {
        #(#places)*
        let span = node.span();
        ::echolume_base::tree::read_table(node, #denies_unknown, &mut [#(#slots),*])?;
        ::core::result::Result::Ok(#made { #(#values),* })
    }
}

/// The variants with their arguments and names.
fn variants<'a>(data: &'a DataEnum, container: &Arguments) -> Result<Vec<(&'a Variant, Arguments, String)>> {
    let each = |variant: &'a Variant| {
        let arguments = Arguments::of(&variant.attrs)?;
        let name = arguments.name(&variant.ident, container)?;
        Ok((variant, arguments, name))
    };
    data.variants.iter().map(each).collect()
}

fn reading_of_enum(input: &DeriveInput, data: &DataEnum, container: &Arguments) -> Result<TokenStream> {
    let all = variants(data, container)?;
    if container.untagged {
        let expecting =
            container.expecting.as_ref().ok_or_else(|| Error::new_spanned(&input.ident, "needs `expecting`"))?;
        let tries = all.iter().map(|(Variant { ident, .. }, ..)| {
            quote! {
                if let ::core::result::Result::Ok(value) = ::echolume_base::tree::FromNode::from_node(node.clone()) {
                    return ::core::result::Result::Ok(Self::#ident(value));
                }
            }
        });
        return Ok(quote! {
            #(#tries)*
            ::core::result::Result::Err(node.fault(#expecting))
        });
    }
    let mut names = Vec::new();
    let mut arms = Vec::new();
    for (index, (variant, arguments, name)) in all.iter().enumerate() {
        let mut spelled: Vec<&String> = arguments.aliases.iter().chain([name]).collect();
        spelled.sort();
        spelled.dedup();
        names.extend(spelled.into_iter().map(|spelled| quote!((#spelled, #index))));
        let ident = &variant.ident;
        let body = match &variant.fields {
            Fields::Unit if container.tag.is_some() => quote! {
                ::echolume_base::tree::read_table(held.table(), false, &mut []).map(|()| Self::#ident)
            },
            Fields::Unit => quote!(held.unit().map(|()| Self::#ident)),
            Fields::Unnamed(fields) if fields.unnamed.len() == 1 => quote! {
                ::echolume_base::tree::FromNode::from_node(held.needed("newtype variant")?).map(Self::#ident)
            },
            Fields::Unnamed(fields) => {
                let count = fields.unnamed.len();
                let each =
                    (0..count).map(|_| quote!(::echolume_base::tree::FromNode::from_node(held.next_element()?)?));
                quote! {
                    let mut held = held.tuple(#count)?;
                    ::core::result::Result::Ok(Self::#ident(#(#each),*))
                }
            }
            Fields::Named(fields) => {
                // The rules of a container are for the names of variants.
                let fields = named(&fields.named, &Arguments::of(&[])?)?;
                let body = table(&fields, container.denies_unknown, &quote!(Self::#ident));
                let node =
                    if container.tag.is_some() { quote!(held.table()) } else { quote!(held.needed("struct variant")?) };
                quote!(let node = #node; #body)
            }
        };
        let pattern = if index + 1 == all.len() { quote!(_) } else { quote!(#index) };
        arms.push(quote!(#pattern => { #body }));
    }
    let split = match &container.tag {
        Some(tag) => quote!(node.tagged(#tag, &[#(#names),*])?),
        None => quote!(node.variant(&[#(#names),*])?),
    };
    Ok(quote! {
        let (index, held) = #split;
        match index { #(#arms)* }
    })
}

fn writing(input: &DeriveInput) -> Result<TokenStream> {
    let container = Arguments::of(&input.attrs)?;
    let body = match &input.data {
        Data::Struct(data) => {
            let fields = named(&data.fields, &container)?;
            let entries = entries(&fields, |ident| quote!(&self.#ident));
            match flattened(&fields) {
                None => quote!(::echolume_base::tree::write_table(&[#(#entries),*])),
                Some(part) => quote! {
                    ::echolume_base::tree::write_table_and(
                        &[#(#entries),*],
                        &::echolume_base::tree::Part::entries(&self.#part),
                    )
                },
            }
        }
        Data::Enum(data) => writing_of_enum(data, &container)?,
        Data::Union(_) => return Err(Error::new_spanned(&input.ident, "is a union")),
    };
    let (name, (generics, types, bounds)) = (&input.ident, input.generics.split_for_impl());
    Ok(quote! {
        #[automatically_derived]
        impl #generics ::echolume_base::tree::ToNode for #name #types #bounds {
            fn to_node(&self) -> ::echolume_base::tree::Node {
                #body
            }
        }
    })
}

/// The key of each field with its value, or None if it is not written. `at`: a reference to a field.
fn entries(fields: &[Named], at: impl Fn(&Ident) -> TokenStream) -> Vec<TokenStream> {
    let written = fields.iter().filter(|field| field.has_key());
    let each = written.map(|Named { ident, arguments, key, .. }| {
        let at = at(ident);
        let value = match &arguments.with {
            Some(with) => quote!(&#with::to_node(#at)),
            None => at.clone(),
        };
        match &arguments.skip_if {
            Some(skip) => {
                quote!((#key, if #skip(#at) { ::core::option::Option::None } else { ::core::option::Option::Some(#value) }))
            }
            None => quote!((#key, ::core::option::Option::Some(#value))),
        }
    });
    each.collect()
}

fn writing_of_enum(data: &DataEnum, container: &Arguments) -> Result<TokenStream> {
    let mut arms = Vec::new();
    for (variant, _, name) in variants(data, container)? {
        let ident = &variant.ident;
        let tag = container.tag.as_ref().map(|tag| quote!((#tag, ::core::option::Option::Some(&#name)),));
        arms.push(match &variant.fields {
            Fields::Unit if tag.is_some() => quote!(Self::#ident => ::echolume_base::tree::write_table(&[#tag])),
            Fields::Unit => quote!(Self::#ident => ::echolume_base::tree::ToNode::to_node(#name)),
            Fields::Unnamed(fields) => {
                let held: Vec<Ident> = (0..fields.unnamed.len()).map(|n| format_ident!("held_{n}")).collect();
                let value = match held.as_slice() {
                    [one] => quote!(#one),
                    _ => quote!(&::echolume_base::tree::write_list(&[#(#held),*])),
                };
                let written = match container.untagged {
                    true => quote!(::echolume_base::tree::ToNode::to_node(#value)),
                    false => {
                        quote!(::echolume_base::tree::write_table(&[(#name, ::core::option::Option::Some(#value))]))
                    }
                };
                quote!(Self::#ident(#(#held),*) => #written)
            }
            Fields::Named(fields) => {
                let fields = named(&fields.named, &Arguments::of(&[])?)?;
                let idents = fields.iter().map(|field| field.ident);
                let entries = entries(&fields, |ident| quote!(#ident));
                let written = match tag {
                    Some(tag) => quote!(::echolume_base::tree::write_table(&[#tag #(#entries),*])),
                    None => quote! {
                        ::echolume_base::tree::write_table(&[(
                            #name,
                            ::core::option::Option::Some(&::echolume_base::tree::write_table(&[#(#entries),*])),
                        )])
                    },
                };
                quote!(Self::#ident { #(#idents),* } => #written)
            }
        });
    }
    Ok(quote!(match self { #(#arms),* }))
}

fn defaulting(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Struct(data) = &input.data else { return Err(Error::new_spanned(&input.ident, "is no struct")) };
    let value = |Field { ident, attrs, .. }: &Field| {
        let value = match attrs.iter().find(|attribute| attribute.path().is_ident("value")) {
            Some(attribute) => attribute.meta.require_list()?.tokens.clone(),
            None => quote!(::core::default::Default::default()),
        };
        Ok(quote!(#ident: #value))
    };
    let values = data.fields.iter().map(value).collect::<Result<Vec<_>>>()?;
    let (name, (generics, types, bounds)) = (&input.ident, input.generics.split_for_impl());
    Ok(quote! {
        #[automatically_derived]
        impl #generics ::core::default::Default for #name #types #bounds {
            fn default() -> Self {
                Self { #(#values),* }
            }
        }
    })
}

/// The variants of an enum, with their names.
fn units(input: &DeriveInput) -> Result<(Vec<&Ident>, Vec<String>)> {
    let Data::Enum(data) = &input.data else { return Err(Error::new_spanned(&input.ident, "is no enum")) };
    let variants = variants(data, &Arguments::of(&input.attrs)?)?;
    Ok(variants.into_iter().map(|(variant, _, name)| (&variant.ident, name)).unzip())
}

fn naming(input: &DeriveInput) -> Result<TokenStream> {
    let ((idents, names), visibility, of) = (units(input)?, &input.vis, &input.ident);
    Ok(quote! {
        impl #of {
            /// The name of the variant, as files and messages have it.
            #visibility fn name(self) -> &'static str {
                match self { #(Self::#idents => #names),* }
            }
        }
    })
}

fn listing(input: &DeriveInput) -> Result<TokenStream> {
    let ((idents, _), visibility, of) = (units(input)?, &input.vis, &input.ident);
    let count = idents.len();
    Ok(quote! {
        impl #of {
            /// All variants, in the order of their declaration.
            #visibility const ALL: [Self; #count] = [#(Self::#idents),*];
        }
    })
}
