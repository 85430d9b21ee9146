//! A cache of shared values. It forgets values that only the cache holds, the least recently used first.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

/// A cache that keeps all values that somebody else holds, and a limited number of others. The value added last is always kept.
pub(crate) struct RecentlyUsed<K, V> {
    /// Each value, and the number of its last use.
    values: HashMap<K, (Arc<V>, u64)>,
    uses: u64,
    max_unused: usize,
}

impl<K: Hash + Eq + Clone, V> RecentlyUsed<K, V> {
    pub fn new(max_unused: usize) -> RecentlyUsed<K, V> {
        RecentlyUsed { values: HashMap::new(), uses: 0, max_unused }
    }

    pub fn get(&mut self, key: &K) -> Option<Arc<V>> {
        self.uses += 1;
        let (value, used) = self.values.get_mut(key)?;
        *used = self.uses;
        Some(value.clone())
    }

    /// Adds a value. Returns the values that were replaced or dropped from the cache, so that the caller can release a lock before they are
    /// destroyed.
    #[must_use]
    pub fn insert(&mut self, key: K, value: Arc<V>) -> Vec<Arc<V>> {
        self.uses += 1;
        let replaced = self.values.insert(key, (value, self.uses)).map(|(value, _)| value);
        let latest = self.uses;
        let unused = self.values.iter().filter(|(_, (value, used))| Arc::strong_count(value) == 1 && *used != latest);
        let mut unused: Vec<(u64, K)> = unused.map(|(key, (_, used))| (*used, key.clone())).collect();
        let surplus = unused.len().saturating_sub(self.max_unused.saturating_sub(1));
        unused.sort_unstable_by_key(|(used, _)| *used);
        let oldest = unused.into_iter().take(surplus).filter_map(|(_, key)| self.values.remove(&key));
        replaced.into_iter().chain(oldest.map(|(value, _)| value)).collect()
    }

    /// Drops the values for whose keys `is_kept` is false.
    pub fn retain(&mut self, is_kept: impl Fn(&K) -> bool) {
        self.values.retain(|key, _| is_kept(key));
    }

    pub fn clear(&mut self) {
        self.values.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_used_longest_ago_and_nobody_holds_is_forgotten() {
        let mut cache = RecentlyUsed::new(3);
        let held = Arc::new(0);
        assert!(cache.insert(0, held.clone()).is_empty());
        for key in 1..=3 {
            assert!(cache.insert(key, Arc::new(key)).is_empty(), "{key}");
        }
        assert_eq!(cache.get(&1).as_deref(), Some(&1));
        let forgotten = cache.insert(4, Arc::new(4));
        assert_eq!(forgotten, [Arc::new(2)], "2 was used before 1, and 0 is held");
        drop(forgotten);
        drop(held);
        let forgotten = cache.insert(5, Arc::new(5));
        assert_eq!(forgotten, [Arc::new(0), Arc::new(3)]);
        let left: Vec<_> = (0..=5).filter(|key| cache.get(key).is_some()).collect();
        assert_eq!(left, [1, 4, 5]);
    }

    #[test]
    fn the_value_added_last_is_kept() {
        let mut cache = RecentlyUsed::new(0);
        assert!(cache.insert('a', Arc::new(1)).is_empty());
        assert_eq!(cache.insert('b', Arc::new(2)), [Arc::new(1)]);
        assert_eq!(cache.get(&'b').as_deref(), Some(&2));
    }

    #[test]
    fn a_replaced_value_is_returned_and_unasked_ones_go() {
        let mut cache = RecentlyUsed::new(1);
        assert!(cache.insert('a', Arc::new(1)).is_empty());
        assert_eq!(cache.insert('a', Arc::new(2)), [Arc::new(1)]);
        cache.retain(|key| *key != 'a');
        assert_eq!(cache.get(&'a'), None);
    }
}
